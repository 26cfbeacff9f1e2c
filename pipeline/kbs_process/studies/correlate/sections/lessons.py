"""Section 8 of the paper, line by line: what each of its conclusions amounts to in this campaign."""

from __future__ import annotations

from collections.abc import Callable

from kbs_process.report.panel import Block, Cell, Grid, Panel
from kbs_process.report.prose import Prose
from kbs_process.report.tables import Tables
from kbs_process.report.text import percent
from kbs_process.results.judged import Budget, Frame
from kbs_process.stages.budget import CORDS, MATRIX, NOISE
from kbs_process.stages.gravity.error import ANGLES
from kbs_process.studies.correlate.choose import at_spacecraft, band_label, main_band, pessimistic
from kbs_process.studies.correlate.results import Merit, Results

_SAYS = Prose("kbs_process.studies.correlate", "lessons")
_TORQUES = ("Tx", "Ty", "Tz")


def panel(results: Results, tables: Tables) -> Panel | None:
    """A line for each conclusion, with figures that other sections explain; then noise against data.

    Only of a rig that stands for a mechanism on a spacecraft, as the paper's did.
    """
    if not at_spacecraft(results):
        return None
    rows = tuple(
        (_SAYS(f"{name}_paper"), _SAYS(name, **facts(results)), Cell(title, to=f"#{key}"))
        for name, facts, key, title in _LINES
    )
    head = ("The paper, section 8", "This campaign", "Explained in")
    band = band_label(results, main_band(results))
    blocks: list[Block] = [Grid("Section 8, line by line", head, rows, "llk", _SAYS("table_note", band=band))]
    if shares := _noise_shares(results):
        body = tuple(
            (trajectory, *(percent(found.get(name), 2) for name in _TORQUES)) for trajectory, found in shares.items()
        )
        title = f"The transducer's noise, as a share of the measured rms, {band}"
        blocks.append(Grid(title, ("Trajectory", *_TORQUES), body, "krrr", _SAYS("noise_note")))
    question = "What does this campaign say of each conclusion that the paper drew from its own?"
    return Panel("lessons", "Lessons of 1996", question, tuple(blocks))


def _fit(results: Results) -> dict[str, object]:
    """The first rung and the last, on the torque that each leaves most of; none of a rig that reads no torques."""
    ladder = () if results.gravity is None else results.gravity.ladder
    torques = [(rung, [(rms, name) for name, rms in rung.rms.items() if name in _TORQUES]) for rung in ladder]
    return {"ladder": [rung for rung, own in torques if own], "worst": [max(own) for _, own in torques if own]}


def _slow(results: Results) -> dict[str, object]:
    channels = () if results.gravity is None else results.gravity.channels
    torques = [one for one in channels if one.channel in _TORQUES and one.static_peak is not None]
    return {"worst": max(torques, key=lambda one: one.static_peak or 0.0, default=None)}


def _resonance(results: Results) -> dict[str, object]:
    """The lowest mode, and the greatest gain of a torque at each band's edge."""
    found = results.transducer
    gains = () if found is None else found.gains
    edges = sorted({one.frequency_Hz for one in gains})
    most = [max((one for one in gains if one.frequency_Hz == edge), key=lambda one: one.gain) for edge in edges]
    return {"most": most, "lowest": min(results.resonances, key=lambda one: one.frequency_Hz, default=None)}


def _encoders(results: Results) -> dict[str, object]:
    """The torque of which the angles' error is the greatest share, and whether that torque is noise."""
    shares = [(row.part(ANGLES) / rms, row, one) for row, one, rms in _budgets(results) if rms > 0.0]
    share, row, one = max(shares, key=lambda each: each[0], default=(0.0, None, None))
    return {
        "share": share,
        "row": row,
        "sigma": row and row.part(ANGLES),
        "noise": one is not None and one.at_the_noise,
    }


def _pessimism(results: Results) -> dict[str, object]:
    """The answer for each torque, at the transducer and at the spacecraft."""
    frames: tuple[Frame, ...] = ("T", "S")
    answers = {frame: [(name, _of(results, frame, name)) for name in _TORQUES] for frame in frames}
    told = {frame: [(name, pessimistic(rows).text) for name, rows in each if rows] for frame, each in answers.items()}
    return {"answers": {frame: each for frame, each in told.items() if each}}


def _of(results: Results, frame: Frame, channel: str) -> list[Merit]:
    band = main_band(results)
    return [one for one in results.merit if (one.band, one.frame, one.channel) == (band, frame, channel)]


def _spacecraft(results: Results) -> dict[str, object]:
    rows = [one for one in results.six_channels if one.band == main_band(results)]
    return {"rows": rows, "assumed": bool(results.notes), "most": max((one.chi_square for one in rows), default=0.0)}


def _forces(results: Results) -> dict[str, object]:
    """What the matrix is of the uncertainty at the spacecraft; and how well both ways know the torque there."""
    rows = [row for row, _, _ in _budgets(results, "S")]
    explained = [one for one in results.six_channels if one.band == main_band(results) and one.explained]
    together = [sigma for one in explained for sigma in one.sigma.values()]
    share = max((row.part(MATRIX) / row.total for row in rows if row.total > 0.0), default=0.0)
    moved = max((row.total for row in rows), default=None)
    return {"share": share, "moved": moved, "together": max(together, default=None)}


def _rig(results: Results) -> dict[str, object]:
    """The torque on which described forces are greatest beside what is left; else what six channels say."""
    rows = {(row.recording, row.channel): (row.part(CORDS), rms) for row, _, rms in _budgets(results)}
    forces = [
        (one, *rows[one.recording, one.channel])
        for one in results.rig_forces
        if (one.band, one.frame) == (main_band(results), "T") and (one.recording, one.channel) in rows
    ]
    measured = max((one for _, one, _ in _budgets(results)), key=lambda one: one.measured_rms or 0.0, default=None)
    worst = max(forces, key=lambda each: each[0].rms, default=None)
    return {"worst": worst, "measured": measured, **_spacecraft(results)}


def _noise(results: Results) -> dict[str, object]:
    shares = _noise_shares(results)
    return {"shares": shares, "noisy": sum(max(found.values()) >= 0.5 for found in shares.values())}


def _noise_shares(results: Results) -> dict[str, dict[str, float]]:
    """By trajectory and torque: the greatest share that the transducer's noise has in the measured rms."""
    trajectories = {one.name: one.trajectory for one in results.recordings}
    shares: dict[str, dict[str, float]] = {}
    for row, _, rms in _budgets(results):
        if row.recording is not None and rms > 0.0:
            own = shares.setdefault(trajectories[row.recording], {})
            own[row.channel] = max(own.get(row.channel, 0.0), row.part(NOISE) / rms)
    return shares


def _budgets(results: Results, frame: Frame = "T") -> list[tuple[Budget, Merit, float]]:
    """Budgets of the torques in the requirement's band, with what was measured, rms."""
    band = main_band(results)
    merit = {(one.recording, one.channel): one for one in results.merit if (one.band, one.frame) == (band, frame)}
    return [
        (row, merit[row.recording, row.channel], merit[row.recording, row.channel].measured_rms or 0.0)
        for row in results.budget
        if (row.band, row.frame) == (band, frame) and row.channel in _TORQUES
        if row.recording is not None and (row.recording, row.channel) in merit
    ]


_LINES: tuple[tuple[str, Callable[[Results], dict[str, object]], str, str], ...] = (
    ("fit", _fit, "gravity", "Gravity fit"),
    ("slow", _slow, "static", "Static wrench"),
    ("resonance", _resonance, "transducer", "Transducer resonance"),
    ("encoders", _encoders, "budget", "Uncertainty"),
    ("pessimism", _pessimism, "merit", "Figures of merit"),
    ("spacecraft", _spacecraft, "budget", "Uncertainty"),
    ("forces", _forces, "coupling", "Cross-coupling"),
    ("rig", _rig, "budget", "Uncertainty"),
    ("noise", _noise, "repeatability", "Repeatability"),
)
