"""The plant: forward dynamics of a driven rig on its transducer, and inverse dynamics of measured motion."""
