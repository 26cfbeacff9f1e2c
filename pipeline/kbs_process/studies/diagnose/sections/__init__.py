"""Sections of the diagnosis' report."""
