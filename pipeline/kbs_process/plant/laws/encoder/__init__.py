"""Errors of encoders: of the disc, of its reading, of the converter."""
