"""Inputs that are damaged or careless, by the thousand: `cd tests && python -m mutations 10000`.

Each is made from a sound one by a change that a seed gives, and is read in a process of its own. What comes of it is
held against what an independent reader makes of the same bytes.
"""
