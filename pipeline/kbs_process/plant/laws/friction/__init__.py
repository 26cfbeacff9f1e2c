"""Friction that follows the rate: Coulomb, viscous, with lubrication, with load, with the angle, with time."""
