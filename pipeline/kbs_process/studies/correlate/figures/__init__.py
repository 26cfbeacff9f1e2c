"""Figures of the correlation report."""
