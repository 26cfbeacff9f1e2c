"""What many units say together: the probability of meeting a requirement, its statistics, and what drives them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from kbs_process.campaign.config import PointingRequirement
from kbs_process.plant.sampling import Uncertain
from kbs_process.results.records import Conclusion, Notice, Status
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Array
from kbs_process.studies.flight.propagation import by_chance, importance, probability, upper_bound
from kbs_process.studies.flight.results import Distribution, Driver, FlightRequirement
from kbs_process.studies.flight.unit import Flown, Judged

CONTENT = CONFIDENCE = 0.95  # of the bound: 95 % of all units, with 95 % confidence
_BANDS = (0.05, 0.5, 0.95)  # quantiles of the histories' envelopes


@dataclass(frozen=True, slots=True, eq=False)
class Flight:
    """All units: the nominal one, and one a row of `drawn` that could be simulated."""

    trajectory: str
    duration_s: float
    numbers: tuple[Uncertain, ...]
    drawn: Array  # (units, numbers)
    nominal: Flown
    units: tuple[Flown, ...]
    failed: int
    seed: int
    judged: tuple[Judged, ...]


def requirement(flight: Flight, index: int) -> FlightRequirement:
    """Return what the units say of one of the requirements."""
    judged = flight.judged[index]
    requirement = judged.requirement
    statistics = np.stack([unit.statistics[index] for unit in flight.units])
    nominal = flight.nominal.statistics[index]
    worst = statistics.max(axis=1)
    return FlightRequirement(
        name=requirement.name,
        quantity="pointing" if isinstance(requirement, PointingRequirement) else requirement.quantity,
        frame=judged.frame,
        statistic=requirement.statistic,
        band_Hz=(None, None) if isinstance(requirement, PointingRequirement) else requirement.band,
        limit=judged.limit,
        unit=judged.unit,
        source=requirement.source,
        meets=probability(int(np.sum(worst <= judged.limit)), len(worst)),
        channels=tuple(
            _distribution(channel, float(nominal[column]), statistics[:, column])
            for column, channel in enumerate(judged.channels)
        ),
        worst=_distribution("greatest", float(nominal.max()), worst),
    )


def _distribution(channel: str, nominal: float, outcomes: Array) -> Distribution:
    q05, median, q95 = np.quantile(outcomes, _BANDS)
    return Distribution(
        channel=channel,
        nominal=nominal,
        mean=float(outcomes.mean()),
        median=float(median),
        q05=float(q05),
        q95=float(q95),
        greatest=float(outcomes.max()),
        bound=upper_bound(outcomes, CONTENT, CONFIDENCE),
    )


def conclusion(requirements: Sequence[FlightRequirement]) -> Conclusion:
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


def drivers(rig: Rig, flight: Flight) -> Iterator[Driver]:
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
                yield Driver(
                    name=number.name,
                    unit=quantities[number.quantity].unit,
                    value=number.value,
                    sigma=number.sigma,
                    requirement=judged.requirement.name,
                    share=float(shares[at]),
                )


def warnings(flight: Flight) -> Iterator[Notice]:
    """Yield what a reader of the verdict must know."""
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
