"""The contents of results.json, typed: what all kinds share, and one module a kind."""
