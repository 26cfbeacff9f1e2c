"""Print one file of schemas/: `python -m kbs_process.studies KIND > schemas/KIND.schema.json`.

KIND is a kind of results (of which `correlation` is schemas/results.schema.json), or a format of a user's files:
campaign, parameters, mission, modal, import.
"""

from __future__ import annotations

import sys

from kbs_process.studies.schemas import schema_text

print(schema_text(sys.argv[1]), end="")
