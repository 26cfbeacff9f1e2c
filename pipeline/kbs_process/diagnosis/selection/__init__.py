"""The search, step by step: from recordings and a model to what a diagnosis reports.

Begin with `explain.py` (how far the known parameters get) and `rounds.py` (candidates, round by round). A round
takes its `leaders.py` from the screen, races them (`race.py`) and asks which is believed (`believed.py`).
"""
