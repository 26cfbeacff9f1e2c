"""Candidates whose shape or size only the residual gives, and how a candidate gets into the plant.

Begin with `view.py` (all candidates as seen from a fit) and `proposals.py` (lines of the residual); `tryout.py` puts
a candidate into the plant or onto its prediction.
"""
