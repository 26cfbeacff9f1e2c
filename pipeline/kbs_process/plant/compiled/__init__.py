"""The plant as compiled code: written for one structure of links and effects, compiled once, stepped.

Begin with `simulation.Simulation`, a plant in motion. `generate` writes its module from parts: `multibody` the tree of
links, `mounting` what carries the plate, `stepping` the step, `loop` and `lanes` the time loops, `taps` the signals
inside. `kernels` and `elementary` are what the written code calls; `compile` keeps it in the user's cache.
"""
