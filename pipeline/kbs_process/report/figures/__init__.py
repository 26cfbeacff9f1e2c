"""The report's figures: the only modules that import matplotlib."""
