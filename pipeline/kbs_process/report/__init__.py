"""The correlation report: shows results.json and the tables, computes nothing."""
