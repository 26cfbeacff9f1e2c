"""Is the model of the rig right? What was fitted, and what was recorded, against what was known, before any verdict."""
