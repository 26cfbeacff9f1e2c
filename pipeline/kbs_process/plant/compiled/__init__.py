"""The plant as compiled code: generated, stepped, simulated."""
