"""A diagnosis inside the results that it is of: where it is, and what other studies read of it."""

from __future__ import annotations

import msgspec

from kbs_process.results.records import Conclusion, Provenance

FOLDER = "diagnosis"  # inside the results that it belongs to


class DiagnosisAnswer(msgspec.Struct, frozen=True, kw_only=True):
    """The answer in a sentence and in a paragraph, and what made it: a part of a diagnosis' results.json."""

    verdict: Conclusion
    paragraph: str
    provenance: Provenance
