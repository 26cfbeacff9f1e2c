"""Stability of the pointing loop over the range."""
