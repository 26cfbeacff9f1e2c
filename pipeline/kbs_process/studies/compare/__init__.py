"""Compare results of processing: campaigns, dates, versions of a model or of the program."""
