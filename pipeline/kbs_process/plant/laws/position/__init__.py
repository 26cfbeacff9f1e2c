"""Torques that depend on where a joint or the motor stands."""
