"""A campaign's recordings through the stages: read, prepared, predicted, analysed, judged."""
