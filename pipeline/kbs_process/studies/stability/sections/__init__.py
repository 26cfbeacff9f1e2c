"""The sections of a stability analysis."""
