"""What a flight prediction leaves on disk: results.json, its tables, and the report."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from kbs_process.campaign.config import Campaign, PointingRequirement
from kbs_process.report.build import build
from kbs_process.results import provenance
from kbs_process.results.outcome import Outcome
from kbs_process.results.records import Conclusion, Notice, Status, encode
from kbs_process.results.store import writing
from kbs_process.results.tables import write_table
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Array
from kbs_process.stages.to_cog import ASSUMPTION
from kbs_process.studies.flight import results as records
from kbs_process.studies.flight.propagation import by_chance, importance, probability, upper_bound

if TYPE_CHECKING:
    from kbs_process.studies.flight.run import Flight, Judged

CONTENT = CONFIDENCE = 0.95  # of the bound: 95 % of all units, with 95 % confidence
_BANDS = (0.05, 0.5, 0.95)  # quantiles of the histories' envelopes
NOTES = (
    "In orbit: no gravity, and the base rigid in a spacecraft that does not yield. Effects of the test rig are gone.",
    "Units differ by the parameters' uncertainties alone, each number independent of the others; a cause that moves "
    "several of them together, or physics that the model lacks, is not in the spread.",
    ASSUMPTION,
)


def write_flight(
    campaign: Campaign, rig: Rig, flight: Flight, sources: Sequence[Path], target: Path, pdf: bool | None
) -> Outcome:
    """Write results, tables and report to `target`."""
    with writing(target) as folder:
        _units(folder, flight)
        for index, judged in enumerate(flight.judged):
            _histories(folder, flight, index, judged)
        results = _results(campaign, rig, flight, sources)
        (folder / "results.json").write_bytes(encode(results))
        from kbs_process.studies.flight.report import DOCUMENT  # draws: takes its time to import

        page = build(folder, DOCUMENT, pdf)
    met = {"pass": True, "fail": False}.get(results.verdict.status)
    return Outcome((results.verdict.sentence,), met, target / page.name)


def _results(campaign: Campaign, rig: Rig, flight: Flight, sources: Sequence[Path]) -> records.FlightResults:
    requirements = tuple(_requirement(flight, index) for index in range(len(flight.judged)))
    units = len(flight.units)
    return records.FlightResults(
        name=campaign.name,
        title=campaign.title,
        article=campaign.article,
        verdict=_conclusion(requirements),
        provenance=provenance.made(
            "flight",
            campaign.folder,
            (*campaign.files, *sources),
            f"--samples {units + flight.failed} --seed {flight.seed}",
        ),
        trajectory=flight.trajectory,
        duration_s=flight.duration_s,
        samples=units,
        failed=flight.failed,
        seed=flight.seed,
        by_chance=by_chance(units, len(flight.numbers)),
        requirements=requirements,
        drivers=tuple(_drivers(rig, flight)),
        warnings=tuple(_warnings(flight)),
        parameters=tuple(provenance.constants(rig)),
        notes=NOTES,
    )


def _requirement(flight: Flight, index: int) -> records.FlightRequirement:
    judged = flight.judged[index]
    requirement = judged.requirement
    statistics = np.stack([unit.statistics[index] for unit in flight.units])
    nominal = flight.nominal.statistics[index]
    worst = statistics.max(axis=1)
    found = probability(int(np.sum(worst <= judged.limit)), len(worst))
    return records.FlightRequirement(
        name=requirement.name,
        quantity="pointing" if isinstance(requirement, PointingRequirement) else requirement.quantity,
        frame=judged.frame,
        statistic=requirement.statistic,
        band_Hz=(None, None) if isinstance(requirement, PointingRequirement) else requirement.band,
        limit=judged.limit,
        unit=judged.unit,
        source=requirement.source,
        meets=records.Likelihood(value=found.value, low=found.low, high=found.high),
        channels=tuple(
            _distribution(channel, float(nominal[column]), statistics[:, column])
            for column, channel in enumerate(judged.channels)
        ),
        worst=_distribution("greatest", float(nominal.max()), worst),
    )


def _distribution(channel: str, nominal: float, outcomes: Array) -> records.Distribution:
    q05, median, q95 = np.quantile(outcomes, _BANDS)
    return records.Distribution(
        channel=channel,
        nominal=nominal,
        mean=float(outcomes.mean()),
        median=float(median),
        q05=float(q05),
        q95=float(q95),
        greatest=float(outcomes.max()),
        bound=upper_bound(outcomes, CONTENT, CONFIDENCE),
    )


def _conclusion(requirements: Sequence[records.FlightRequirement]) -> Conclusion:
    """Pass where 95 % of all units meet every requirement with confidence, fail where fewer do."""
    worst = min(requirements, key=lambda one: (one.meets.low, -one.worst.q95 / one.limit))
    status: Status = "undecided"
    if all(one.worst.bound is not None and one.worst.bound <= one.limit for one in requirements):
        status = "pass"
    elif worst.meets.high < CONTENT:
        status = "fail"
    sentence = (
        f"{worst.name}: a flight unit meets it with a probability of {100 * worst.meets.value:.1f} % "
        f"({100 * worst.meets.low:.1f} to {100 * worst.meets.high:.1f} %). {worst.statistic.capitalize()} "
        f"{worst.worst.nominal:.3g} {worst.unit} nominally, {worst.worst.q05:.3g} to {worst.worst.q95:.3g} "
        f"{worst.unit} in 90 % of the units; limit {worst.limit:.3g} {worst.unit}."
    )
    return Conclusion(status=status, sentence=sentence)


def _drivers(rig: Rig, flight: Flight) -> Iterable[records.Driver]:
    """Yield the numbers that explain more than chance would, most important first."""
    quantities = rig.quantities()
    cyclic = np.array([number.cyclic for number in flight.numbers], dtype=np.bool_)
    for index, judged in enumerate(flight.judged):
        worst = np.array([unit.statistics[index].max() for unit in flight.units])
        shares = importance(flight.drawn, cyclic, worst)
        floor = by_chance(len(worst), len(shares))
        for at in np.argsort(-shares, kind="stable"):
            if shares[at] > floor:
                number = flight.numbers[at]
                yield records.Driver(
                    name=number.name,
                    unit=quantities[number.quantity].unit,
                    value=number.value,
                    sigma=number.sigma,
                    requirement=judged.requirement.name,
                    share=float(shares[at]),
                )


def _warnings(flight: Flight) -> Iterable[Notice]:
    if flight.failed:
        yield Notice(
            severity="warning",
            what=f"{flight.failed} of {flight.failed + len(flight.units)} units could not be simulated: left out",
            remedy="look for parameters whose sigma reaches values that no unit has",
        )
    if upper_bound(np.zeros(len(flight.units)), CONTENT, CONFIDENCE) is None:
        yield Notice(
            severity="warning",
            what=f"{len(flight.units)} units are too few for a bound of 95 % with 95 % confidence",
            remedy="take --samples 59 or more",
        )


def _units(folder: Path, flight: Flight) -> None:
    """Write one row a unit: what was drawn, and its statistics."""
    columns = {number.name: flight.drawn[:, column] for column, number in enumerate(flight.numbers)}
    for index, judged in enumerate(flight.judged):
        for column, channel in enumerate(judged.channels):
            name = f"{index}.{channel}.{judged.requirement.statistic}"
            columns[name] = np.array([unit.statistics[index][column] for unit in flight.units])
    write_table(folder / "tables" / "flight" / "units.parquet", columns, {})


def _histories(folder: Path, flight: Flight, index: int, judged: Judged) -> None:
    """Write the nominal envelope, and between which values 90 % of the units lie, stretch by stretch."""
    nominal = flight.nominal.envelopes[index]
    every = np.stack([unit.envelopes[index] for unit in flight.units])  # (units, bins, 2, channels)
    low = np.quantile(every[:, :, 0], 0.05, axis=0)
    high = np.quantile(every[:, :, 1], 0.95, axis=0)
    columns = {"t": (np.arange(len(nominal)) + 0.5) * flight.duration_s / len(nominal)}
    for column, channel in enumerate(judged.channels):
        columns |= {
            f"{channel}.low": nominal[:, 0, column],
            f"{channel}.high": nominal[:, 1, column],
            f"{channel}.q05": low[:, column],
            f"{channel}.q95": high[:, column],
        }
    units = dict.fromkeys(columns, judged.unit) | {"t": "s"}
    path = folder / "tables" / "flight" / f"requirement_{index}.parquet"
    write_table(path, columns, units, frame=judged.frame)
