"""Every candidate effect along the plant linearised about the nominal fit, and where the residual enters.

Begin with `screen.py` (candidates ranked by what they would gain) and `ports.py` (which port could explain all).
`suspects.py` lists the candidates, `signature.py` and `transfer.py` say what each would show, `gls.py` fits it.
"""
