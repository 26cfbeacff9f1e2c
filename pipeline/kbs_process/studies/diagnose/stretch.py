"""The part of a long recording that a diagnosis looks at.

It simulates every recording some hundred times and holds the slopes of a hundred numbers along it: of hours, neither
ends in a day nor fits into memory. What moves most says most.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from kbs_process.campaign.config import Campaign, RecordingEntry
from kbs_process.progress import Progress
from kbs_process.reduction.held import read_alive
from kbs_process.reduction.predicting import AT_REST
from kbs_process.signals.records import Loss, Run
from kbs_process.stages.repeats import motion_of

LONGEST_S = 600.0
PASSED_OVER = "not looked at"  # kind of loss: readings outside that part


def read_stretch(campaign: Campaign, entry: RecordingEntry, progress: Progress) -> Run:
    """Read a recording without what its channels were held in, or the busiest `LONGEST_S` of one that is longer."""
    with progress.task(f"Reading {entry.name}"):
        run = read_alive(campaign, entry)
    span = busiest(run)
    if span is None:
        return run
    whole = _seconds(run)
    with progress.task(
        f"Reading {entry.name}: of its {whole:.0f} s the {LONGEST_S:.0f} s from {span[0]:.0f} s on, which move most"
    ):
        begin = entry.start or 0.0
        part = read_alive(campaign, replace(entry, start=begin + span[0], end=begin + span[1]))
    told = f"of its {whole:.0f} s only those from {begin + span[0]:.0f} s to {begin + span[1]:.0f} s, which move most"
    left = Loss(PASSED_OVER, "wrench", round((whole - LONGEST_S) * run.load_rates[0]), detail=told)
    return replace(part, losses=(*part.losses, left))


def busiest(run: Run) -> tuple[float, float] | None:
    """Span, s, of the `LONGEST_S` along which joints go farthest, from rest if possible; None of a short run."""
    moved = motion_of(run)
    if moved is None or _seconds(run) <= LONGEST_S:
        return None
    steps = np.abs(np.diff(moved.values, axis=0))
    way = np.concatenate([[0.0], np.cumsum(steps.sum(axis=1))])
    count = round(LONGEST_S / moved.dt)
    gone = way[count:] - way[:-count]
    rests = steps[: len(gone)].max(axis=1) < AT_REST * moved.dt
    gone = gone[: len(rests)]
    start = int(np.argmax(np.where(rests, gone, -1.0) if rests.any() else gone)) * moved.dt + moved.t0
    return start, start + LONGEST_S


def _seconds(run: Run) -> float:
    return 0.0 if run.loads is None else len(run.loads) * run.loads.dt
