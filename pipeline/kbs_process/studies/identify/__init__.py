"""Motor-gear parameters from recordings."""
