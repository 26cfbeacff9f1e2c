"""Repeats on one grid, what predicts them, and what repeats differ by."""
