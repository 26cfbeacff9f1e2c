"""A campaign: its description, its store of results, and the pipeline that leads from one to the other."""
