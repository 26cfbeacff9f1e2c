"""Where a simulated day differs from a published one, and why: what of the numbers found is said."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence

import numpy as np

from kbs_process.report.prose import Prose
from kbs_process.rig.model import Rig
from kbs_process.studies.reference_day.results import PublishedSection, Section

_MDEG = 1e3 * 180.0 / np.pi
_SAYS = Prose("kbs_process.studies.reference_day", "discussion")

Compared = Sequence[tuple[Section, PublishedSection]]


def discussion(rig: Rig, sections: Sequence[Section]) -> Iterator[str]:
    """Yield paragraphs; none where no section has published figures to be compared with."""
    compared = [(one, one.published) for one in sections if one.published is not None]
    if compared:
        yield from _times(compared)
        yield from _pointing(compared)
        yield from _encoder(rig, compared)
        yield from _torque(compared)
        yield from _loop(rig, compared)


def _times(compared: Compared) -> Iterator[str]:
    late = [section.end_s - published.end_s for section, published in compared]
    worst = compared[int(np.argmax(np.abs(late)))][0]
    yield _SAYS("times", least=min(late), most=max(late), worst=worst.name)
    for (_, before), (section, published) in itertools.pairwise(compared):
        allotted = published.end_s - before.end_s
        taken = section.end_s - section.start_s
        if section.modes and section.modes[0].startswith(("hand-over", "pre-pointing")) and allotted > taken:
            yield _SAYS("slew", name=section.name, taken=taken, allotted=allotted)


def _pointing(compared: Compared) -> Iterator[str]:
    for axis in ("azimuth", "elevation"):
        ours = np.array([getattr(section, axis).percentile * _MDEG for section, _ in compared])
        theirs = np.array([getattr(published, f"{axis}_mdeg") for _, published in compared])
        ratio = ours / theirs
        low, high = (compared[int(pick(ratio))][0].name for pick in (np.argmin, np.argmax))
        median = np.median(ratio)
        yield _SAYS("pointing", axis=axis, ours=ours, theirs=theirs, ratio=ratio, median=median, low=low, high=high)


def _encoder(rig: Rig, compared: Compared) -> Iterator[str]:
    """What rounding alone would make: 95 % of an error uniform within half a code lie below 0.475 codes."""
    codes = [float(joint.encoder.step) * _MDEG for joint in rig.joints if joint.encoder is not None]
    if not codes or max(codes) == 0.0:
        return
    slow, fast = (pick(compared, key=lambda pair: pair[0].greatest_rate) for pick in (min, max))
    at_rest, moving = _greatest(*slow), _greatest(*fast)
    slow_rate, fast_rate = (np.degrees(section.greatest_rate) for section, _ in (slow, fast))
    yield _SAYS(
        "encoder",
        code=max(codes), slow=slow[0], slow_rate=slow_rate, at_rest=at_rest,
        fast=fast[0], fast_rate=fast_rate, moving=moving,
    )  # fmt: skip
    if at_rest[0] > moving[0]:
        yield _SAYS("rounding")


def _greatest(section: Section, published: PublishedSection) -> tuple[float, float]:
    """The worse axis' 95 %, mdeg: ours and published."""
    ours = max(section.azimuth.percentile, section.elevation.percentile) * _MDEG
    return ours, max(published.azimuth_mdeg, published.elevation_mdeg)


def _torque(compared: Compared) -> Iterator[str]:
    inside = max((section for section, _ in compared), key=lambda one: one.torques[0].value)
    whole = max((section for section, _ in compared), key=lambda one: one.torques[-1].value)
    published = max(one.torque_Nm for _, one in compared)
    quiet, bound = min((section.torques[-1].value, one.torque_Nm) for section, one in compared)
    yield _SAYS("torque", inside=inside, whole=whole, published=published, quiet=quiet, bound=bound)
    if inside.torques[0].value < 0.5 * published:
        yield _SAYS("internal", mast=inside.mast)


def _loop(rig: Rig, compared: Compared) -> Iterator[str]:
    controller = rig.controller
    if controller is None or controller.loop != "closed" or controller.latency == 0:
        return
    rate = max(section.greatest_rate for section, _ in compared)
    lead = rate * controller.latency * float(controller.cycle) * _MDEG
    yield _SAYS("lead", latency=controller.latency, lead=lead, rate=np.degrees(rate))
