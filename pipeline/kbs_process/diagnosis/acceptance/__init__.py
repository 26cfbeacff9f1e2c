"""Whether a candidate that was refitted in the plant is accepted, and the detection that is reported then.

Begin with `verdict.py`, which asks all questions, `gate.py`, the test on recordings that were not used, and
`finding.py`; `outcome.py` has the types of what a diagnosis says.
"""
