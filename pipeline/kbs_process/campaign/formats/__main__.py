"""Print the JSON Schema of one format: `python -m kbs_process.campaign.formats FORMAT > schemas/FORMAT.schema.json`."""

from __future__ import annotations

import sys

from kbs_process.campaign.formats.schemas import schema_text

print(schema_text(sys.argv[1]), end="")
