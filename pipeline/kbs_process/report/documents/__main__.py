"""Print the JSON Schema of one kind of results: `python -m kbs_process.report.documents KIND`."""

from __future__ import annotations

import json
import sys

from kbs_process.report.documents import DOCUMENTS
from kbs_process.report.records.common import schema_of

document = DOCUMENTS[sys.argv[1]]
print(json.dumps(schema_of(document.record, document.title), indent=2))
