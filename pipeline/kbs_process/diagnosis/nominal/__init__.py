"""The nominal fit: known parameters at their maximum a posteriori, near their priors, and what they leave.

Begin with `known.py` (the fit and its result) and `joint.py` (the same with a candidate's numbers beside the known
ones). The search itself is `search.py` over `tangents.py` (slopes) over `costs.py`; `detection.py` says whether
anything is left.
"""
