"""From raw samples on their own clocks to one time axis at the working rate."""
