"""MCAP files: read a chunk at a time, verified, never trusted; and written."""
