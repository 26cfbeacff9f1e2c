"""Numerics of estimation, which know no rig: least squares with priors and bounds, whitening, intervals, tails.

Begin with `fit.py`: parameters with priors, a fit and its checks.
"""
