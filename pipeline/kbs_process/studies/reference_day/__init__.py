"""A day in orbit: planned, flown, judged."""
