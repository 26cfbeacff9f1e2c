"""Sections over frequency and over order."""
