"""From raw force/torque recordings of a pointing mechanism to a correlation report."""

__version__ = "0.1.0"
