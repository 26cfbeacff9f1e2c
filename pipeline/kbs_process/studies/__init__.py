"""Studies: one folder a verb of the command line, from its run to its report."""
