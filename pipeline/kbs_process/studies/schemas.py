"""All of schemas/: kinds of results, and formats of the files that a user writes."""

from __future__ import annotations

import json

from kbs_process.campaign.formats import schemas as formats
from kbs_process.errors import ConfigError, did_you_mean
from kbs_process.results.records import schema_of
from kbs_process.studies.convert.mapping_file import MappingFile
from kbs_process.studies.documents import DOCUMENTS

FORMATS = formats.FORMATS | {"import": MappingFile}


def schema_text(kind: str) -> str:
    """Return the JSON Schema of a kind of results, or of a format."""
    if kind not in FORMATS | DOCUMENTS:
        raise ConfigError(f"there is no schema '{kind}'", remedy=did_you_mean(kind, FORMATS | DOCUMENTS))
    if kind in FORMATS:
        schema = formats.schema_of(kind, FORMATS[kind])
    else:
        schema = schema_of(DOCUMENTS[kind].record, DOCUMENTS[kind].title)
    return json.dumps(schema, indent=2, ensure_ascii=False) + "\n"
