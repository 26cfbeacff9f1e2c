"""The formats of a campaign's files, each stated once: keys, types, bounds, units, defaults and what they mean.

`tables` has what they are made of, `faults` says in words where a file breaks one, and `python -m
kbs_process.campaign.formats` prints one of them as JSON Schema, for editors.
"""
