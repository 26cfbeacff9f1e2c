"""Between the controller's command and the magnetic field: gain, delay, jitter."""
