"""Errors of the transducer: its calibration, its converter, its drift."""
