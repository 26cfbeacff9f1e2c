"""Where a simulated day differs from a published one, and why: sentences made of the numbers found."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence

import numpy as np

from kbs_process.campaign.config import Campaign
from kbs_process.campaign.formats.mission_file import Published
from kbs_process.rig.model import Rig
from kbs_process.studies.reference_day.day import Section

_MDEG = 1e3 * 180.0 / np.pi

Compared = Sequence[tuple[Section, Published]]


def discussion(campaign: Campaign, sections: Sequence[Section]) -> tuple[str, ...]:
    """Return paragraphs; none where no section has published figures to be compared with."""
    compared = [(one, one.entry.published) for one in sections if one.entry.published is not None]
    if not compared:
        return ()
    return (
        *_times(compared),
        *_pointing(compared),
        *_encoder(campaign.rig, compared),
        *_torque(compared),
        *_loop(campaign.rig, compared),
    )


def _times(compared: Compared) -> Iterator[str]:
    late = [section.end - section.entry.near for section, _ in compared]
    worst = compared[int(np.argmax(np.abs(late)))][0]
    yield (
        "Times. Sections follow from the geometry: which satellite is lost when, and how long the antenna needs to "
        f"reach the other. They end {min(late):+.0f} to {max(late):+.0f} s from the published, approximate times; "
        f"section {worst.entry.name} differs most. The orbit's phase and the node's longitude were chosen so that "
        "the three losses come when they do in the table; the published orbit is not given. Splits within a pass "
        "are our reading of the table."
    )
    for (before, _), (section, _) in itertools.pairwise(compared):
        allotted = section.entry.near - before.entry.near
        taken = section.end - section.start
        if section.modes and section.modes[0].startswith(("hand-over", "pre-pointing")) and allotted > taken:
            yield (
                f"Section {section.entry.name} takes {taken:.0f} s where the table allots {allotted:.0f} s: ours is "
                "as fast as the limits allow over our angles; the published one turned further, waited, or was "
                "planned with a margin."
            )


def _pointing(compared: Compared) -> Iterator[str]:
    for axis, name in enumerate(("azimuth", "elevation")):
        ours = np.array([section.statistics[axis].percentile * _MDEG for section, _ in compared])
        theirs = np.array([(one.azimuth_mdeg, one.elevation_mdeg)[axis] for _, one in compared])
        ratio = ours / theirs
        low, high = (compared[int(pick(ratio))][0].entry.name for pick in (np.argmin, np.argmax))
        yield (
            f"95 % of the {name} error. Ours are {ours.min():.1f} to {ours.max():.1f} mdeg, the published "
            f"{theirs.min():.1f} to {theirs.max():.1f} mdeg. Ours over published: median {np.median(ratio):.2f}, "
            f"least {ratio.min():.2f} (section {low}), greatest {ratio.max():.2f} (section {high})."
        )


def _encoder(rig: Rig, compared: Compared) -> Iterator[str]:
    """What rounding alone would make: 95 % of an error uniform within half a code lie below 0.475 codes."""
    codes = [float(joint.encoder.step) * _MDEG for joint in rig.joints if joint.encoder is not None]
    if not codes or max(codes) == 0.0:
        return
    slow = min(compared, key=lambda pair: pair[0].greatest_rate)
    fast = max(compared, key=lambda pair: pair[0].greatest_rate)
    (at_rest, theirs_at_rest), (moving, theirs_moving) = _greatest(*slow), _greatest(*fast)
    yield (
        f"Cause. A code of our encoder is {max(codes):.1f} mdeg; 95 % of an error uniform within half a code lie "
        f"below {0.475 * max(codes):.1f} mdeg. In the slowest section ({slow[0].entry.name}, at most "
        f"{np.degrees(slow[0].greatest_rate):.3f} deg/s) 95 % lie below {at_rest:.1f} mdeg (published "
        f"{theirs_at_rest:.1f}), in the fastest ({fast[0].entry.name}, {np.degrees(fast[0].greatest_rate):.2f} "
        f"deg/s) below {moving:.1f} mdeg (published {theirs_moving:.1f})."
    )
    if at_rest > moving:
        yield (
            "So our error is mostly the loop's response to rounding: an axis that moves slowly stays within one "
            "code for long, where the loop cannot see it, and fast motion averages the rounding out. Where the "
            "published errors are greater at speed, something else is in them: the encoder's resolution, the gains "
            "and the definition of the error are not given, and an error of the encoder itself over a turn, which "
            "ours does not have, would add to them at any speed."
        )


def _greatest(section: Section, published: Published) -> tuple[float, float]:
    """The worse axis' 95 %, mdeg: ours and published."""
    ours = max(one.percentile for one in section.statistics) * _MDEG
    return ours, max(published.azimuth_mdeg, published.elevation_mdeg)


def _torque(compared: Compared) -> Iterator[str]:
    narrow = max((section for section, _ in compared), key=lambda one: one.torques[0].value)
    wide = max((section for section, _ in compared), key=lambda one: one.torques[-1].value)
    published = max(one.torque_Nm for _, one in compared)
    inside, whole = narrow.torques[0].value, wide.torques[-1].value
    quiet, least = min((section.torques[-1].value, one.torque_Nm) for section, one in compared)
    yield (
        f"Torque. In the requirement's band ours reach {inside:.2g} N m (section {narrow.entry.name}), the published "
        f"{published:.2g} N m; {wide.torques[-1].label}, ours reach {whole:.2g} N m (section {wide.entry.name}) and "
        f"{quiet:.2g} N m in the quietest section, where the published bound is {least:.2g} N m."
    )
    if inside < 0.5 * published:
        yield (
            "What the drives exert within the unit is internal: on a rigid interface only changes of the unit's "
            "momentum reach the spacecraft, and those that cogging, tooth passing and friction cause lie near the "
            "drives' resonance and above, well beyond 1 Hz, unless the motor turns very slowly. The published "
            "figures can come from resonances of the mast and the spacecraft, from a filter that is not described, "
            "or from steeper changes of commanded rate; without these the table's torques cannot be reproduced, "
            "and ours are no bound for a flexible mast."
        )


def _loop(rig: Rig, compared: Compared) -> Iterator[str]:
    controller = rig.controller
    if controller is None or controller.loop != "closed" or controller.latency == 0:
        return
    rate = max(section.greatest_rate for section, _ in compared)
    lead = rate * controller.latency * float(controller.cycle) * _MDEG
    yield (
        f"Convention. The loop compares with an encoder reading {controller.latency} cycle(s) old, and is given the "
        f"angle desired then. Given the present one, it would lead the trajectory by rate x latency: {lead:.0f} "
        f"mdeg at the day's {np.degrees(rate):.2f} deg/s. The published errors while the antenna turns fast are far "
        "smaller, so that theirs must be free of that lead too."
    )
