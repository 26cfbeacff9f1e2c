"""Records that flow through the pipeline, and the frames they are expressed in."""
