"""Why recordings and prediction differ."""
