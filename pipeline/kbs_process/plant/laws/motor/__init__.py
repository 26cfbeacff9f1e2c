"""The stepper motor: its synchronous torque, and what its poles, teeth and currents add."""
