"""Identification of a rig's numbers from its recordings: search, objective, uncertainty."""
