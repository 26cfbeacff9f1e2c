"""Every candidate effect along the linearised plant."""
