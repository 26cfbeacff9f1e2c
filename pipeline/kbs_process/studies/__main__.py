"""Print the JSON Schema of one kind of results: `python -m kbs_process.studies KIND`."""

from __future__ import annotations

import json
import sys

from kbs_process.results.records import schema_of
from kbs_process.studies.documents import DOCUMENTS

document = DOCUMENTS[sys.argv[1]]
print(json.dumps(schema_of(document.record, document.title), indent=2))
