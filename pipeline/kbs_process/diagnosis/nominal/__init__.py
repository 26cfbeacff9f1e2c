"""The nominal fit: known parameters near their priors."""
