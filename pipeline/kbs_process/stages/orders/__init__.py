"""Orders: what of a load is periodic in a joint's angle, and which of its peaks chance does not make."""
