"""The plant: forward dynamics of a driven rig on its transducer, and inverse dynamics of measured motion.

Begin with `predict.predict`, which drives a plant by commands and yields what its sensors read, and with
`rigid.inverse_dynamics`, which goes the other way from a measured motion. `laws` holds the physics that a plant can
contain, `effect` and `sensing` what a law declares, `compiled` the plant as generated and compiled code, `linear` the
plant linearised at a pose. `structure` says on what the generated code depends, and the numbers that fill it.
"""
