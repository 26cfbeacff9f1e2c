"""Predictions of the plant: on commands alone, or along a recording."""
