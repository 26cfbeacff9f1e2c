"""What every rival is given: residuals of the plant with its known parameters refitted, and the plant's signals.

Rivals start where the diagnosis starts: the same recordings on one clock, the same floor from repeats, the same refit
of known parameters within their uncertainties. What they are compared by is what they make of the rest.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from proof.answer import HeldOut, Moved

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """One recording: `residual` is measured less predicted, each channel in units of its floor's rms."""

    name: str
    held_out: bool
    trajectory: int
    dt: float  # s
    valid: NDArray[np.bool_]  # (n,)
    residual: Array  # (n, c)
    signals: Mapping[str, Array]  # (n,) each: see `library`
    whiten: Callable[[Array], Array]  # (n, c) in the residual's units -> white numbers of unit variance at the floor


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """A trial as rivals see it."""

    trial: str
    channels: tuple[str, ...]  # wrench, then "angle.JOINT"
    joints: tuple[str, ...]
    recordings: tuple[Recording, ...]
    moved: tuple[Moved, ...]  # known parameters that had to move by more than three sigma
    log10_p: float  # of the residual being no more than the floor
    seconds: float  # that all this took

    @property
    def fitted(self) -> tuple[Recording, ...]:
        return tuple(recording for recording in self.recordings if not recording.held_out)

    @property
    def held_out(self) -> tuple[Recording, ...]:
        return tuple(recording for recording in self.recordings if recording.held_out)


def detrended(recording: Recording, columns: Array) -> Array:
    """Columns (n, k) at valid samples, less their best straight line: bias and steady drift are no find."""
    inside = np.flatnonzero(recording.valid)
    line = np.stack([np.ones(len(inside)), np.linspace(-1.0, 1.0, len(inside))], axis=1)
    chosen = columns[inside]
    left: Array = chosen - line @ np.linalg.lstsq(line, chosen, rcond=None)[0]
    return left


def stacked(recordings: Sequence[Recording], columns: Callable[[Recording], Array]) -> Array:
    """Detrended columns of all recordings, one below the other."""
    return np.concatenate([detrended(recording, columns(recording)) for recording in recordings])


def held_out(case: Case, predicted: Callable[[Recording], Array]) -> HeldOut | None:
    """Whitened rms of what held-out recordings leave, before and after subtracting `predicted` (n, c)."""
    if not case.held_out:
        return None
    before = [recording.whiten(recording.residual) for recording in case.held_out]
    after = [recording.whiten(recording.residual - predicted(recording)) for recording in case.held_out]
    return HeldOut(before=_rms(before), after=_rms(after))


def _rms(parts: Sequence[Array]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))
