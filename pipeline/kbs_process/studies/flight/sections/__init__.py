"""The sections of a flight prediction's report."""
