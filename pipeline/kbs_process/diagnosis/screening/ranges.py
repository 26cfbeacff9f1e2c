"""Over which places, widths, times and frequencies a search for suspects goes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from kbs_process.diagnosis.experiments.hypothesis import Tapped
from kbs_process.diagnosis.screening.scene import Scene
from kbs_process.plant.effect import Parameter
from kbs_process.plant.laws import CATALOGUE, SENSING
from kbs_process.signals.records import Array

SPECTRUM = "spectrum"  # grid of a parameter that only tones of a residual give
TURNS = "turns"  # kind of one which is an order, of what a signal sweeps
WHILE_RECORDED = "time.span"  # that of one which is a time, in lengths of the longest recording


def by_parameter(found: Mapping[tuple[str, str], tuple[float, ...]]) -> dict[str, tuple[float, ...]]:
    """Values of parameters, "name" or "name.joint", of what was `found` of a kind that proposes them, at a joint."""
    return {
        f"{entry.name}.{joint}" if joint else entry.name: values
        for (kind, joint), values in found.items()
        if values
        for law in (*CATALOGUE, *SENSING)
        for entry in law.parameters
        if entry.proposed == kind
    }


def is_place(entry: Parameter) -> bool:
    """Whether a shape is a place in what a signal sweeps."""
    return entry.over not in ("", SPECTRUM) and "." not in entry.over


@dataclass(frozen=True, slots=True)
class Ranges:
    """What signals sweep over all trials of an experiment, and what the residuals propose.

    `spans`: (site, signal) -> least and greatest value. `proposed`: parameter, of one site "name.site" -> values beside
    those of its grid.
    """

    spans: Mapping[tuple[str, str], tuple[float, float]]
    proposed: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    temperature: bool = False  # whether it was recorded
    longest: float = np.inf  # s, of the trajectories

    def within(self, entry: Parameter, site: str) -> tuple[float, float]:
        """Between which values what a shape is a place or a width of goes at a site; (0, 0) where nobody knows it."""
        return self.spans.get((site, entry.over.partition(".")[0]), (0.0, 0.0))

    def choices(self, entry: Parameter, site: str, own: float | None) -> tuple[float, ...]:
        """Return the values of a shape parameter that are tried at a site, least first.

        None, where its grid lies over a signal that nobody knows there, or that rests: places and widths in what it
        sweeps are within bounds, or there are none. Without a grid: `own`, or its prior's middle.
        """
        proposed = (*self.proposed.get(entry.name, ()), *self.proposed.get(f"{entry.name}.{site}", ()))
        if entry.over == SPECTRUM:
            return tuple(sorted(proposed))
        if not entry.over:
            low, high = entry.bounds
            grid = tuple(sorted({*entry.grid, *(value for value in proposed if low <= value <= high)}))
            return grid or (entry.prior.middle if own is None else own,)
        signal, _, kind = entry.over.partition(".")
        span = self.spans.get((site, signal))
        if span is None:
            return ()
        low, high = span
        least, most = entry.bounds
        if kind == TURNS:
            orders = {*entry.grid, *proposed}
            return tuple(sorted(k for k in orders if k * (high - low) >= 2.0 * np.pi and least <= k <= most))
        start = 0.0 if kind == "span" else low
        places = {*(start + share * (high - low) for share in entry.grid), *proposed} if high > low else set()
        return tuple(sorted(place for place in places if least <= place <= most))


def swept(
    scene: Scene, *, proposed: Mapping[str, tuple[float, ...]] | None = None, temperature: bool = False
) -> Ranges:
    """Return what a scene sweeps, over all of its trajectories."""
    experiment = scene.experiment
    references = sorted({experiment.reference(k) for k in range(len(experiment.repeats))})
    return ranges_of(
        [scene.signals[drive] for drive in references if drive in scene.signals],
        [scene.predicted[drive].values for drive in references],
        experiment.channels,
        experiment.dt,
        proposed=proposed,
        temperature=temperature,
    )


def ranges_of(
    tapped: Sequence[Tapped],
    predictions: Sequence[Array],
    channels: Sequence[str],
    dt: float,
    *,
    proposed: Mapping[str, tuple[float, ...]] | None = None,
    temperature: bool = False,
) -> Ranges:
    """Return what taps and predictions (n, c), `dt` s apart, of all trajectories sweep."""
    spans: dict[tuple[str, str], tuple[float, float]] = {}

    def extend(site: str, signal: str, values: Array) -> None:
        low, high = spans.get((site, signal), (float(values.min()), float(values.max())))
        spans[site, signal] = (min(low, float(values.min())), max(high, float(values.max())))

    for one in tapped:
        for k, column in enumerate(one.columns):
            signal, _, joint = column.partition(".")
            extend(joint, signal, one.values[:, k])
    whole = [one.readings for one in tapped if one.readings is not None]
    for prediction in (*predictions, *whole):
        for k, channel in enumerate(channels):
            extend(channel, "reading", prediction[:, k])
    longest = max(len(prediction) for prediction in predictions) * dt
    sites = {site for site, _ in spans} | {"wrench", "encoder"}
    spans |= {(site, "time"): (0.0, longest) for site in sites}
    return Ranges(spans, dict(proposed or {}), temperature, longest)
