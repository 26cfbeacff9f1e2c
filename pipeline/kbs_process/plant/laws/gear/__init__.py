"""The gear between motor and output: stiffness, play, kinematic error."""
