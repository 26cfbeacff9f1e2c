"""Concealed campaigns: recordings of rigs that contain physics which their descriptions leave out, or do not.

Made by the independent engine; nothing of the package under test is imported, so that finding what is concealed means
something. `trials.draw` says what trials there are, `trials.make` makes one and returns its truth.
"""
