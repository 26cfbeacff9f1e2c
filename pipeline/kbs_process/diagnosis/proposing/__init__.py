"""Candidate effects: where their shapes and sizes come from."""
