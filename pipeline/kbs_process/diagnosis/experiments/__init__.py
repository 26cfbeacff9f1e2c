"""What is compared with what: repeats on one grid, what predicts them, what repeats differ by, and the metric of it.

Begin with `experiment.py` (recordings), `hypothesis.py` (predictions) and `floor.py` (the noise between repeats);
`metric.py` puts them together.
"""
