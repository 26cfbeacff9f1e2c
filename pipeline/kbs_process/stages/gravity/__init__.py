"""The gravity and centre-of-gravity model: fitted over joint angles, subtracted from the decoupled wrench."""
