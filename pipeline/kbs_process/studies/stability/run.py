"""Stability of the pointing loop over a joint's range: linear analysis, and the onset found by simulation."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from kbs_process.campaign.config import Campaign
from kbs_process.progress import Progress
from kbs_process.report.build import publish
from kbs_process.results import provenance
from kbs_process.results.outcome import Outcome
from kbs_process.results.records import Conclusion
from kbs_process.results.store import writing
from kbs_process.signals.records import Array
from kbs_process.studies.stability import loop, onset
from kbs_process.studies.stability.report import DOCUMENT
from kbs_process.studies.stability.results import (
    CriticalAt,
    LimitCycle,
    LoopMargins,
    OnsetAt,
    Sensitivity,
    StabilityResults,
)
from kbs_process.studies.stability.sweep import Sweep, sweep_of

GAIN_MARGIN, PHASE_MARGIN = 2.0, np.radians(30.0)  # customary: 6 dB and 30 deg


@dataclass(frozen=True, slots=True)
class Simulations:
    """Where the onset is looked for by simulation: each takes seconds."""

    poses: int = 5
    weights: tuple[float, ...] = (0.0, 1.0, 4.0, 10.0)  # of Ki over Kp, at the pose with the least margin
    shares: tuple[float, ...] = (0.25, 0.5, 0.75, 0.9, 0.97)  # of the critical factor, for limit cycles there


def analyse_stability(
    campaign: Campaign,
    target: Path,
    *,
    joint: str | None,
    low_deg: float,
    high_deg: float,
    points: int,
    progress: Progress,
    pdf: bool | None = None,
    simulations: Simulations = Simulations(),
) -> Outcome:
    """Analyse the loop over the angles of `joint` (default: the last one), the others at zero; write to `target`."""
    sweep = sweep_of(campaign, joint)
    angles = np.radians(np.linspace(low_deg, high_deg, points))
    with writing(target) as folder:
        margins: list[LoopMargins] = []
        critical: list[CriticalAt] = []
        with progress.task("Linearising over the range") as task:
            for done, angle in enumerate(angles, start=1):
                margins += sweep.margins(angle)
                critical.append(sweep.critical(angle))
                task.update(done / points)
            sweep.write_poles(folder, angles)
        worst = min(critical, key=lambda entry: entry.factor or np.inf)
        with progress.task("Uncertainty of the critical gain"):
            sensitivities = sweep.sensitivities(worst.angle_rad)
        with progress.task("Looking for the onset by simulation") as task:
            simulated = angles[np.unique(np.linspace(0, points - 1, simulations.poses).astype(int))]
            onsets = tuple(_onsets(sweep, simulated, worst, simulations.weights, task.update))
            cycles = tuple(_limit_cycles(sweep, worst, simulations.shares))
        with progress.task("Writing the report"):
            found = _results(campaign, sweep, worst, margins, critical, sensitivities, onsets, cycles)
            return publish(folder, target, found, DOCUMENT, pdf)


def _onsets(
    sweep: Sweep, angles: Array, worst: CriticalAt, weights: Sequence[float], update: Callable[[float], None]
) -> Iterator[OnsetAt]:
    """Bisect the onset at every angle with and without friction, and at the worst one with other weights of Ki."""
    jobs = [(float(angle), 1.0, friction) for angle in angles for friction in (False, True)]
    jobs += [(worst.angle_rad, weight, False) for weight in weights if (worst.angle_rad, weight, False) not in jobs]
    smooth = onset.smooth_rig(sweep.rig)
    for done, (angle, weight, friction) in enumerate(jobs, start=1):
        predicted = loop.critical(sweep.linear(angle), sweep.controller, integral=weight).factor
        if np.isfinite(predicted):
            rig = sweep.rig if friction else smooth
            found = onset.onset(rig, sweep.effects, sweep.pose(angle), predicted, integral=weight)
            yield OnsetAt(
                angle_rad=angle,
                integral_weight=weight,
                friction=friction,
                predicted=predicted,
                found=None if found is None else found.factor,
                half_width=None if found is None else found.half_width,
                frequency_Hz=None if found is None else loop.finite(found.frequency),
            )
        update(done / (len(jobs) + 1))


def _limit_cycles(sweep: Sweep, worst: CriticalAt, shares: Sequence[float]) -> Iterator[LimitCycle]:
    """What is left of a kick at the gains as run, and at shares of the critical ones."""
    if worst.factor is None:
        return
    for share in (1.0 / worst.factor, *shares):
        factor = share * worst.factor
        pose = sweep.pose(worst.angle_rad)
        found = onset.ring(sweep.rig, sweep.effects, pose, proportional=factor, integral=factor)
        yield LimitCycle(factor=factor, share_of_critical=share, rms_rad=found.late, frequency_Hz=found.frequency)


def _results(
    campaign: Campaign,
    sweep: Sweep,
    worst: CriticalAt,
    margins: Sequence[LoopMargins],
    critical: Sequence[CriticalAt],
    sensitivities: tuple[Sensitivity, ...],
    onsets: tuple[OnsetAt, ...],
    cycles: tuple[LimitCycle, ...],
) -> StabilityResults:
    rig, controller = sweep.rig, sweep.controller
    gains = (tuple(np.broadcast_to(gain.value, len(rig.joints)).tolist()) for gain in (controller.Kp, controller.Ki))
    Kp, Ki = gains
    sigma = float(np.linalg.norm([entry.sigma_of_factor for entry in sensitivities]))
    return StabilityResults(
        name=campaign.name,
        title=campaign.title,
        article=campaign.article,
        verdict=_conclusion(margins, worst, sigma),
        provenance=provenance.made("stability", campaign.folder, campaign.files),
        joint=sweep.joint,
        joints=tuple(dict.fromkeys(entry.joint for entry in margins)),
        cycle_s=float(controller.cycle),
        latency=controller.latency,
        loop=controller.loop,
        Kp=Kp,
        Ki=Ki,
        worst_angle_rad=worst.angle_rad,
        worst_sigma=sigma,
        kick_rad=onset.KICK,
        encoder_step_rad=max((float(j.encoder.step) for j in rig.joints if j.encoder is not None), default=0.0),
        margins=tuple(margins),
        critical=tuple(critical),
        boundary=tuple(sweep.boundary(worst.angle_rad)),
        onsets=onsets,
        limit_cycles=cycles,
        sensitivities=sensitivities,
        parameters=tuple(provenance.constants(rig)),
    )


def _conclusion(margins: Sequence[LoopMargins], worst: CriticalAt, sigma: float) -> Conclusion:
    """Judge by the customary margins of 6 dB and 30 deg; `sigma` is that of the critical factor."""
    if worst.factor is None:
        return Conclusion(status="pass", sentence="No gain up to the largest that was tried makes the loop unstable.")
    gain = min(worst.factor, *(entry.gain or np.inf for entry in margins))
    phase = min((entry.phase_rad for entry in margins if entry.phase_rad is not None), default=np.inf)
    ok = gain >= GAIN_MARGIN and phase >= PHASE_MARGIN
    sentence = (
        f"The pointing loop {'keeps' if ok else 'does not keep'} the customary margins of 6 dB and 30 deg: all gains "
        f"may grow {worst.factor:.2f} +- {2.0 * sigma:.2f} times (k = 2) before it oscillates at "
        f"{worst.frequency_Hz:.2f} Hz, at {np.degrees(worst.angle_rad):.0f} deg; "
        f"gain margin {20.0 * np.log10(gain):.1f} dB, phase margin {np.degrees(phase):.0f} deg."
    )
    return Conclusion(status="pass" if ok else "fail", sentence=sentence)
