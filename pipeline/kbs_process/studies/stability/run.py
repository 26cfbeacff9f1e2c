"""Stability of the pointing loop over a joint's range: linear analysis, and the onset found by simulation."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np

from kbs_process.campaign.config import Campaign
from kbs_process.errors import ConfigError, did_you_mean
from kbs_process.plant.laws import select
from kbs_process.plant.linear.linearise import Linear, linearise
from kbs_process.plant.structure import structure_of
from kbs_process.progress import Progress
from kbs_process.report.build import build
from kbs_process.results import provenance
from kbs_process.results.outcome import Outcome
from kbs_process.results.records import Conclusion, encode
from kbs_process.results.store import writing
from kbs_process.results.tables import write_table
from kbs_process.rig.model import Controller, Rig, substitute
from kbs_process.signals.records import Array
from kbs_process.studies.stability import loop as stability
from kbs_process.studies.stability import onset
from kbs_process.studies.stability.results import (
    Boundary,
    CriticalAt,
    LimitCycle,
    LoopMargins,
    OnsetAt,
    Sensitivity,
    StabilityResults,
)

GAIN_MARGIN, PHASE_MARGIN = 2.0, np.radians(30.0)  # customary: 6 dB and 30 deg
WEIGHTS = (0.0, 1.0, 4.0, 10.0)  # of Ki over Kp, at which the onset is looked for by simulation
_WEIGHTS_DRAWN = (0.0, 0.5, 1.0, 2.0, 4.0, 7.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0, 45.0, 50.0)
_SHARES = (0.25, 0.5, 0.75, 0.9, 0.97)  # of the critical factor, at which limit cycles are looked at
_SIMULATED = 5  # poses
_SWEPT = 200.0  # Hz, of the modes in the map of poles


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
) -> Outcome:
    """Analyse the loop over the angles of `joint` (default: the last one), the others at zero; write to `target`."""
    controller = _controller(campaign)
    rig = campaign.rig
    names = rig.joint_names
    swept = names[-1] if joint is None else joint
    if swept not in names:
        raise ConfigError(f"there is no joint '{swept}'", where=campaign.name, remedy=did_you_mean(swept, names))
    structure_of(rig, select(campaign.effects))  # refuses a rig without drives or on a turning transducer
    angles = np.radians(np.linspace(low_deg, high_deg, points))
    with writing(target) as folder:
        with progress.task("Linearising over the range") as task:
            systems = [_system(campaign, rig, swept, angle) for angle in angles]
            margins, critical = [], []
            for done, (angle, system) in enumerate(zip(angles, systems, strict=True), start=1):
                margins += list(_margins(system, controller, angle))
                critical.append(_critical(campaign, swept, system, controller, angle))
                task.update(done / len(angles))
            _write_poles(folder, angles, systems, controller)
        worst = min(range(points), key=lambda i: critical[i].factor or np.inf)
        boundary = tuple(_boundary(systems[worst], controller))
        with progress.task("Uncertainty of the critical gain"):
            sensitivities = _sensitivities(campaign, swept, angles[worst], controller)
        with progress.task("Looking for the onset by simulation") as task:
            simulated = angles[np.unique(np.linspace(0, points - 1, _SIMULATED).astype(int))]
            onsets, cycles = _simulated(campaign, swept, simulated, float(angles[worst]), controller, task.update)
        found = StabilityResults(
            name=campaign.name,
            title=campaign.title,
            article=campaign.article,
            verdict=_conclusion(margins, critical[worst], sensitivities),
            provenance=provenance.made("stability", campaign.folder, campaign.files),
            joint=swept,
            joints=systems[0].joints,
            cycle_s=float(controller.cycle),
            latency=controller.latency,
            loop=controller.loop,
            Kp=tuple(float(value) for value in np.broadcast_to(controller.Kp.value, len(names))),
            Ki=tuple(float(value) for value in np.broadcast_to(controller.Ki.value, len(names))),
            worst_angle_rad=float(angles[worst]),
            worst_sigma=float(np.linalg.norm([entry.sigma_of_factor for entry in sensitivities])),
            kick_rad=onset.KICK,
            encoder_step_rad=max((float(j.encoder.step) for j in rig.joints if j.encoder is not None), default=0.0),
            margins=tuple(margins),
            critical=tuple(critical),
            boundary=boundary,
            onsets=tuple(onsets),
            limit_cycles=tuple(cycles),
            sensitivities=sensitivities,
            parameters=tuple(provenance.constants(rig)),
        )
        (folder / "results.json").write_bytes(encode(found))
        with progress.task("Writing the report"):
            from kbs_process.studies.stability.report import DOCUMENT  # draws: takes its time to import

            page = build(folder, DOCUMENT, pdf)
    return Outcome((found.verdict.sentence,), found.verdict.status == "pass", target / page.name)


def _controller(campaign: Campaign) -> Controller:
    controller = campaign.rig.controller
    if campaign.drive == "motion" or controller is None:
        raise ConfigError(
            "this campaign has no controller whose loop could be analysed",
            where=campaign.name,
            remedy='describe [controller] and set drive = "command"',
        )
    return controller


def _pose(rig: Rig, joint: str, angle: float) -> Array:
    return np.array([angle if name == joint else 0.0 for name in rig.joint_names])


def _system(campaign: Campaign, rig: Rig, joint: str, angle: float, *, at_rest: bool = False) -> Linear:
    """Linearise without friction, or with the slopes that it has at standstill."""
    return linearise(rig if at_rest else onset.smooth_rig(rig), select(campaign.effects), _pose(rig, joint, angle))


def _margins(system: Linear, controller: Controller, angle: float) -> Iterable[LoopMargins]:
    cut = stability.loop(system, controller)
    for joint in system.joints:
        found = stability.margins(cut, joint)
        yield LoopMargins(
            angle_rad=float(angle),
            joint=joint,
            gain=_finite(found.gain),
            gain_frequency_Hz=_finite(found.gain_frequency),
            phase_rad=_finite(found.phase),
            phase_frequency_Hz=_finite(found.phase_frequency),
            sensitivity_peak=found.sensitivity_peak,
            sensitivity_frequency_Hz=found.sensitivity_frequency,
        )


def _critical(campaign: Campaign, joint: str, system: Linear, controller: Controller, angle: float) -> CriticalAt:
    found = stability.critical(system, controller)
    resting = stability.critical(_system(campaign, campaign.rig, joint, angle, at_rest=True), controller)
    return CriticalAt(
        angle_rad=float(angle),
        factor=_finite(found.factor),
        frequency_Hz=found.frequency if np.isfinite(found.factor) else None,
        at_rest=_finite(resting.factor),
    )


def _write_poles(folder: Path, angles: Array, systems: Sequence[Linear], controller: Controller) -> None:
    """Write the poles of the plant alone (true frequencies) and of the closed loop (folded below half its rate)."""
    rows: list[tuple[float, float, float, float]] = []
    for angle, system in zip(angles, systems, strict=True):
        plant, closed = stability.natural(system), stability.poles(stability.loop(system, controller))
        for closes, values in ((0.0, plant), (1.0, closed)):
            for pole in values[values.imag >= 0.0]:
                frequency = float(pole.imag / (2.0 * np.pi))
                if 1e-6 < frequency < _SWEPT:
                    rows.append((float(angle), closes, frequency, float(-pole.real / abs(pole))))
    columns = np.array(rows).T
    names = {"angle": "rad", "closed": "1", "frequency": "Hz", "damping": "1"}
    table = {name: np.ascontiguousarray(column) for name, column in zip(names, columns, strict=True)}
    write_table(folder / "tables" / "stability" / "poles.parquet", table, names)


def _boundary(system: Linear, controller: Controller) -> Iterable[Boundary]:
    for weight in _WEIGHTS_DRAWN:
        found = stability.critical(system, controller, integral=weight)
        if np.isfinite(found.factor):
            yield Boundary(integral_weight=weight, proportional=found.factor, integral=weight * found.factor)


def _sensitivities(campaign: Campaign, joint: str, angle: float, controller: Controller) -> tuple[Sensitivity, ...]:
    """Move every uncertain number of the rig by a sigma; those of a quantity add in squares."""
    rig = campaign.rig

    nominal = stability.critical(_system(campaign, rig, joint, angle), controller).factor
    if not np.isfinite(nominal):
        return ()

    def factor(other: Rig) -> float:
        return stability.critical_near(_system(campaign, other, joint, angle), controller, nominal)

    found = []
    for name, quantity in rig.quantities().items():
        if name.split(".")[0] not in ("body", "joint", "transducer") or not np.any(quantity.sigma > 0.0):
            continue
        changes = []
        for index in np.argwhere(quantity.sigma > 0.0):
            value = quantity.value.copy()
            value[tuple(index)] += quantity.sigma[tuple(index)]
            changes.append(factor(substitute(rig, {name: value})) - nominal)
        sigma = float(np.linalg.norm(changes))
        if sigma > 1e-4 * nominal:
            found.append(Sensitivity(name=name, sigma_of_factor=sigma))
    return tuple(sorted(found, key=lambda entry: -entry.sigma_of_factor))


def _simulated(
    campaign: Campaign, joint: str, angles: Array, worst: float, controller: Controller, update: Callable[[float], None]
) -> tuple[list[OnsetAt], list[LimitCycle]]:
    rig, smooth = campaign.rig, onset.smooth_rig(campaign.rig)
    jobs = [(float(angle), 1.0, friction) for angle in angles for friction in (False, True)]
    jobs += [(worst, weight, False) for weight in WEIGHTS if (worst, weight, False) not in jobs]
    onsets = []
    for done, (angle, weight, friction) in enumerate(jobs, start=1):
        system = _system(campaign, rig, joint, angle)
        predicted = stability.critical(system, controller, integral=weight).factor
        if np.isfinite(predicted):
            found = onset.onset(
                rig if friction else smooth, campaign.effects, _pose(rig, joint, angle), predicted, integral=weight
            )
            onsets.append(
                OnsetAt(
                    angle_rad=angle,
                    integral_weight=weight,
                    friction=friction,
                    predicted=predicted,
                    found=None if found is None else found.factor,
                    half_width=None if found is None else found.half_width,
                    frequency_Hz=None if found is None else _finite(found.frequency),
                )
            )
        update(done / (len(jobs) + 1))
    critical = stability.critical(_system(campaign, rig, joint, worst), controller).factor
    shares = (1.0 / critical, *_SHARES) if np.isfinite(critical) else ()
    return onsets, [_limit_cycle(campaign, _pose(rig, joint, worst), share, critical) for share in shares]


def _limit_cycle(campaign: Campaign, q: Array, share: float, critical: float) -> LimitCycle:
    factor = share * critical
    found = onset.ring(campaign.rig, campaign.effects, q, proportional=factor, integral=factor)
    return LimitCycle(factor=factor, share_of_critical=share, rms_rad=found.late, frequency_Hz=found.frequency)


def _conclusion(margins: Sequence[LoopMargins], worst: CriticalAt, sensitivities: Sequence[Sensitivity]) -> Conclusion:
    """Judge by the customary margins of 6 dB and 30 deg."""
    if worst.factor is None:
        return Conclusion(status="pass", sentence="No gain up to the largest that was tried makes the loop unstable.")
    gain = min(worst.factor, *(entry.gain or np.inf for entry in margins))
    phase = min((entry.phase_rad for entry in margins if entry.phase_rad is not None), default=np.inf)
    ok = gain >= GAIN_MARGIN and phase >= PHASE_MARGIN
    sigma = float(np.linalg.norm([entry.sigma_of_factor for entry in sensitivities]))
    sentence = (
        f"The pointing loop {'keeps' if ok else 'does not keep'} the customary margins of 6 dB and 30 deg: all gains "
        f"may grow {worst.factor:.2f} +- {2.0 * sigma:.2f} times (k = 2) before it oscillates at "
        f"{worst.frequency_Hz:.2f} Hz, at {np.degrees(worst.angle_rad):.0f} deg; "
        f"gain margin {20.0 * np.log10(gain):.1f} dB, phase margin {np.degrees(phase):.0f} deg."
    )
    return Conclusion(status="pass" if ok else "fail", sentence=sentence)


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
