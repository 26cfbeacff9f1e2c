"""From recordings to the correlation report: the study that gives the program its name."""
