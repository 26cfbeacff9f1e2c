"""Diagnosis: where recordings and plant differ beyond repeatability, by what physics, and how sure that is."""
