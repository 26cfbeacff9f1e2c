"""Sections of the identification's report."""
