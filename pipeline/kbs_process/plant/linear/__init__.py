"""The plant linearised: modes, modal models, forced response."""
