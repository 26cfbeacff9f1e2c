"""Estimation: parameters from data and prior knowledge, with their covariance and named checks."""
