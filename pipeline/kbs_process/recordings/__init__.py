"""Recordings in and out: MCAP, decoded a chunk at a time, verified, and never trusted."""

from kbs_process.recordings.inspection import FieldRange, Inspection, TopicInspection, inspect_recording
from kbs_process.recordings.mcap.messages.encoding import OutStream
from kbs_process.recordings.mcap.source import Source, TopicSummary, open_recording
from kbs_process.recordings.mcap.streams import Stream
from kbs_process.recordings.mcap.writer import write_mcap, write_pieces

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
