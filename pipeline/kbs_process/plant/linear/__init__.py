"""The plant linearised about rest at a pose.

Begin with `linearise.linearise`. `modes` are its resonances, `modal` the interface wrench through a modal model,
`mounted` where the plate rests on a mounting that is not linear.
"""
