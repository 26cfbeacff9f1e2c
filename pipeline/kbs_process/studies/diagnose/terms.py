"""What records and sentences of a diagnosis say alike."""

from __future__ import annotations

import numpy as np

from kbs_process.diagnosis.selection.outcome import Identity
from kbs_process.studies.diagnose import results as records

CORRECTED = "corrected"  # folder of the corrected model, and
COMMANDS = "next-test.csv"  # file of the next test's commands, in that of the results


def place_of(identity: Identity) -> records.Place:
    """A port and its site, in a record."""
    return records.Place(port=identity.port, site=identity.axis, channels=identity.channels)


def rms(ratio: float) -> float:
    """Of a ratio of powers."""
    return float(np.sqrt(max(ratio, 0.0)))
