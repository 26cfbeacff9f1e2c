"""Methods that compete with the diagnosis, on the same recordings and the same plant."""
