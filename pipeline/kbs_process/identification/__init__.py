"""Identification of the motor-gears' numbers from recordings.

Begin with `estimate.py`, which tells the story: starts (`screening.py`), searches from them (`search.py`), refinement
and intervals. `unknowns.py` says which numbers are free and what is known of them, `output_error.py` what is made
small.
"""
