"""Diagnosis: where recordings and plant differ beyond repeatability, by what physics, and how sure that is.

The rooms, from below; each knows those before it alone:

    experiments   recordings on one grid, what predicts them, the noise between repeats, the metric of a comparison
    nominal       the known parameters fitted near their priors, and what they leave
    screening     every candidate effect along the plant linearised about the fit, and where the residual enters
    proposing     candidates whose shape or size only the residual gives: lines, orders, curves, clocks, springs
    acceptance    whether a candidate that was refitted in the plant is one, and the detection that is reported
    selection     the search, step by step: explain, then rounds of leaders, then the next test

Begin with `selection/explain.py` and `selection/rounds.py`, which tell the story, and `acceptance/outcome.py`, which
says what comes out. Thresholds and their reasons are in `experiments/thresholds.py`.
"""
