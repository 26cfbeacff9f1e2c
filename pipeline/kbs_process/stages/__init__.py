"""The stages of the pipeline: pure functions from records to records."""
