"""What a reference day leaves on disk: results.json and its tables."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from kbs_process.campaign.config import Campaign
from kbs_process.campaign.mission import Day
from kbs_process.mission import orbit
from kbs_process.mission.planner import Plan
from kbs_process.reduction.pointing import estimate
from kbs_process.results import provenance
from kbs_process.results.records import Conclusion, Constant, encode
from kbs_process.results.tables import write_table
from kbs_process.signals.records import Array, Mask, Signal
from kbs_process.stages.to_cog import ASSUMPTION
from kbs_process.stages.verdict import COVERAGE, judge
from kbs_process.studies.reference_day import results as records
from kbs_process.studies.reference_day.day import TORQUES, Assessed, Section, Verdict
from kbs_process.studies.reference_day.discussion import discussion

_ORDER = ("pass", "undecided", "fail")
MODES = ("tracking", "zenith", "hand-over", "pre-pointing")  # codes in the table of the trajectory

NOTES = (
    "In orbit: no gravity, and the interface rigid in a spacecraft that does not yield. Effects of the test rig "
    "are gone.",
    "Pointing error: true joint angle of the plant less the angle that the trajectory desires at the same instant. "
    "Errors of orbit, attitude and mounting are not in it, nor thermal distortion or an encoder that is not "
    "linear; the encoder's alignment counts as uncertainty of the bias.",
    "Uncertainties of pointing are those that the length of a section leaves, given how the error is correlated; "
    "those of the plant's parameters are propagated by the flight prediction.",
    "Torque peaks are those of one run with the parameters as given; no uncertainty is stated for them.",
    ASSUMPTION,
)


def write_tables(folder: Path, planned: Plan, found: Assessed) -> None:
    """Write trajectory, pointing errors and torques of the day."""
    codes = np.empty(len(planned.t))
    for phase in planned.phases:
        codes[phase.start : phase.end] = MODES.index(phase.mode)
    write_table(
        folder / "tables" / "day" / "trajectory.parquet",
        {"t": planned.t, "az": planned.q[:, 0], "el": planned.q[:, 1], "offset": planned.offset, "mode": codes},
        {"t": "s", "az": "rad", "el": "rad", "offset": "rad", "mode": "1"},
        frame="T",
        history=("desired angles at every cycle", "mode: " + ", ".join(MODES)),
    )
    _write(folder, "error", found.error)
    _write(folder, "boresight", found.boresight)
    for signal, extreme in zip(found.torques, found.sections[0].torques, strict=True):
        _write(folder, f"torque.{extreme.band.name}", signal, TORQUES)


def _write(folder: Path, stem: str, signal: Signal, channels: tuple[str, ...] = ()) -> None:
    columns: dict[str, Array | Mask] = {"t": signal.t, "valid": signal.valid}
    columns |= {name: signal.column(name) for name in channels or signal.channels}
    units = dict(zip(signal.channels, signal.units, strict=True))
    write_table(
        folder / "tables" / "day" / f"{stem}.parquet",
        columns,
        {"t": "s"} | {name: units[name] for name in columns if name in units},
        frame=signal.frame,
        history=signal.history,
    )


def write_results(
    folder: Path, campaign: Campaign, day: Day, planned: Plan, found: Assessed
) -> records.ReferenceDayResults:
    """Write results.json; return its contents."""
    judged = (*(_judged(one) for one in found.verdicts), *_torque_judged(campaign, found))
    results = records.ReferenceDayResults(
        name=campaign.name,
        title=campaign.title,
        article=campaign.article,
        verdict=_conclusion(judged),
        provenance=provenance.made("reference-day", campaign.folder, (*campaign.files, day.path)),
        geometry=_geometry(day, planned),
        phases=tuple(
            records.Phase(
                mode=phase.mode,
                relay=phase.relay,
                start_s=float(planned.t[phase.start]),
                end_s=float(planned.t[phase.end - 1]),
            )
            for phase in planned.phases
        ),
        sections=tuple(_section(section) for section in found.sections),
        requirements=judged,
        boresight=tuple(estimate(one) for one in found.whole),
        discussion=discussion(campaign, found.sections),
        parameters=(*_constants(day), *provenance.constants(campaign.rig)),
        notes=NOTES,
    )
    (folder / "results.json").write_bytes(encode(results))
    return results


def _section(section: Section) -> records.Section:
    azimuth, elevation = section.statistics
    published = section.entry.published
    return records.Section(
        name=section.entry.name,
        start_s=section.start,
        end_s=section.end,
        ends_with=section.entry.until,
        modes=section.modes,
        greatest_rate=section.greatest_rate,
        azimuth=estimate(azimuth),
        elevation=estimate(elevation),
        torques=tuple(
            records.Torque(band=one.band.name, label=one.label, value=one.value, axis=one.axis, time_s=one.time)
            for one in section.torques
        ),
        published=None
        if published is None
        else records.PublishedSection(
            azimuth_mdeg=published.azimuth_mdeg,
            elevation_mdeg=published.elevation_mdeg,
            torque_Nm=published.torque_Nm,
            torque=published.torque,
            comment=published.comment,
            end_s=section.entry.near,
        ),
    )


def _judged(one: Verdict) -> records.Judged:
    return records.Judged(
        name=one.requirement.name,
        statistic=one.requirement.statistic,
        limit=one.requirement.limit,
        unit="rad",
        value=one.value,
        sigma=one.sigma,
        verdict=one.verdict,
        where=one.where,
        source=one.requirement.source,
    )


def _torque_judged(campaign: Campaign, found: Assessed) -> Iterable[records.Judged]:
    """Judge peaks of torque in the narrowest band; the campaign's other requirements are not about a day's peaks."""
    for requirement in campaign.requirements:
        if (requirement.quantity, requirement.frame, requirement.statistic) != ("torque", "S", "peak"):
            continue
        section = max(found.sections, key=lambda one: one.torques[0].value)
        worst = section.torques[0]
        yield records.Judged(
            name=requirement.name,
            statistic=f"peak, {worst.label}",
            limit=requirement.limit,
            unit=requirement.unit,
            value=worst.value,
            sigma=0.0,
            verdict=judge(worst.value, 0.0, requirement.limit),
            where=f"{worst.axis}, section {section.entry.name}, {worst.time:.1f} s",
            source=requirement.source,
        )


def _conclusion(judged: Sequence[records.Judged]) -> Conclusion:
    if not judged:
        return Conclusion(status="none", sentence="The mission states no requirement.")
    worst = max(judged, key=lambda one: (_ORDER.index(one.verdict), one.value / one.limit))
    words = {"pass": "All requirements are met", "fail": "A requirement is not met", "undecided": "Undecided"}
    value, sigma, limit, unit = _shown(worst)
    sentence = (
        f"{words[worst.verdict]}. Nearest to its limit: {worst.name}, {value:.4g} +- {COVERAGE * sigma:.2g} {unit} "
        f"(k = {COVERAGE:g}; {worst.where}); limit {limit:g} {unit}."
    )
    return Conclusion(status=worst.verdict, sentence=sentence)


def _shown(one: records.Judged) -> tuple[float, float, float, str]:
    """Value, sigma and limit in the unit that requirements on pointing are written in."""
    if one.unit != "rad":
        return one.value, one.sigma, one.limit, one.unit
    return (float(np.degrees(one.value)), float(np.degrees(one.sigma)), round(float(np.degrees(one.limit)), 9), "deg")


def _geometry(day: Day, planned: Plan) -> records.Geometry:
    rate, acceleration = planned.extremes(day.mission.cycle)
    satellite = orbit.satellite(day.mission.orbit)
    low, high = planned.q.min(axis=0), planned.q.max(axis=0)
    return records.Geometry(
        epoch=day.mission.orbit.epoch.isoformat(),
        nodal_period_s=day.mission.orbit.nodal_period,
        semi_major_axis_m=float(satellite.a) * orbit.EARTH_RADIUS,
        node_rate=float(satellite.nodedot) / 60.0,
        greatest_rate=float(rate.max()),
        greatest_acceleration=float(acceleration.max()),
        rate_limit=day.mission.limits.rate,
        acceleration_limit=day.mission.limits.acceleration,
        azimuth=(float(low[0]), float(high[0])),
        elevation=(float(low[1]), float(high[1])),
    )


def _constants(day: Day) -> Iterable[Constant]:
    for one in day.quantities:
        yield Constant(
            name=f"mission.{one.name}",
            value=", ".join(f"{x:.9g}" for x in np.ravel(one.value)),
            unit=one.unit,
            sigma=", ".join(f"{x:.3g}" for x in np.ravel(one.sigma)),
            source=one.source,
        )
