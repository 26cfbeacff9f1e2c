"""Why recordings and prediction differ.

`run` is the story and `results` what comes out of it. `reading` and `diagnosable` bring recordings into it, `records`
and `output` store what it finds, `sections` and `prose` tell it. `diagnosing` runs it at the end of processing.
"""
