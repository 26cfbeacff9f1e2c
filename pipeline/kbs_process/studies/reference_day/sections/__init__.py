"""The sections of a reference day's report."""
