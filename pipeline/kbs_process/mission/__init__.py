"""The mission: orbit, lines of sight to relay satellites, and the trajectory that the antenna is commanded."""
