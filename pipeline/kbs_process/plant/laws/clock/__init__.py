"""Errors of clocks: by how much the stamps of a stream are late."""
