"""Recordings in and out: MCAP, decoded a chunk at a time, verified, and never trusted."""

from kbs_process.ingest.encoding import OutStream
from kbs_process.ingest.inspection import FieldRange, Inspection, TopicInspection, inspect_recording
from kbs_process.ingest.source import Source, TopicSummary, open_recording
from kbs_process.ingest.streams import Stream
from kbs_process.ingest.writer import write_mcap, write_pieces

__all__ = [
    "FieldRange",
    "Inspection",
    "OutStream",
    "Source",
    "Stream",
    "TopicInspection",
    "TopicSummary",
    "inspect_recording",
    "open_recording",
    "write_mcap",
    "write_pieces",
]
