"""Is the model of the rig right? What was fitted against what was known, before anything is judged by it.

`validate` and processing ask the same here: every fitted number against its prior, each recording's zero, the slope of
what is read against computed loads, and what a calibration leaves. Where one of them is beyond what chance allows,
no requirement is met; what a simple fault would explain is said first.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import msgspec
import numpy as np

from kbs_process.campaign.config import Campaign, Requirement
from kbs_process.plant.laws import select
from kbs_process.plant.linear.modes import modes
from kbs_process.progress import Progress
from kbs_process.reduction import measurable
from kbs_process.reduction.preparing import Prepared, tare
from kbs_process.reduction.relief import relieved
from kbs_process.reduction.soundness import words
from kbs_process.reduction.soundness.noise import measured_noise, unlike_stated
from kbs_process.reduction.soundness.streams import copied, mistimed, repeated, stuck
from kbs_process.results.judged import WRONG, Doubt, Soundness
from kbs_process.results.kept import kept
from kbs_process.results.records import Notice
from kbs_process.rig.model import Rig
from kbs_process.signals.records import WRENCH_CHANNELS, Array, Mask
from kbs_process.signals.smoothing import smooth
from kbs_process.stages.align.clocks import late_sigma
from kbs_process.stages.conventions import (
    BEYOND,
    SignCheck,
    check_encoder_sense,
    check_gravity_sign,
    check_response,
    check_weight,
)
from kbs_process.stages.gravity import model as gravity
from kbs_process.stages.gravity.equation import Equation
from kbs_process.stages.gravity.equation import Prepared as Instants
from kbs_process.stages.gravity.hypotheses import RATHER, explanations, shown_gains, turned
from kbs_process.stages.gravity.model import GravityModel, Sample, prepared
from kbs_process.stages.gravity.tension import KNOWN_S, TAKEN, Moved, Shift, Tension, lag, misread, tension
from kbs_process.stages.repeats import commanded

LEFT = 0.1  # of the weight, and of the torque that it can make: a calibration leaves less, whatever rubs or pulls
FOLLOWED = 0.5  # share of what is left of a channel that follows its computed load: a gain, or what looks like one
NEAR = 0.1  # of the article's reach from the transducer: no spacecraft's centre of mass is there
SHOWN = 0.2  # relative error of a gain that the other channels show: beyond, the equation is no line any more
EARTH = (9.7, 9.9)  # m/s^2, of gravity
FINEST = 0.01  # of a gain, or degrees of an angle's zero: recordings may differ by this
SILENT = 0.1  # slope, against computed loads, of a channel that does not respond


@dataclass(frozen=True, slots=True)
class Checked:
    """What was found of the model of the rig, and the self-tests of signs behind it."""

    soundness: Soundness
    conventions: tuple[SignCheck, ...]
    hidden: Mapping[str, tuple[Doubt, ...]]  # by requirement, what the samples cannot show
    rounding: Mapping[str, float]  # by channel, of readings that are coarser than stated
    noise: Mapping[str, Mapping[str, float]]  # of a sample, rms, by recording and channel, as measured
    mute: tuple[str, ...]  # channels that are judged, and that no recording shows to respond
    unconfirmed: tuple[str, ...]  # channels whose slope against computed loads no recording tests
    late: Mapping[str, float]  # s, by recording: the wrench's lag behind the angles, as gravity shows it

    def doubts(self, requirement: Requirement) -> tuple[Doubt, ...]:
        """Why a requirement is not judged, worst first.

        What a calibrated transducer reads beyond the limit it has read, whatever pulls: if its angles are right.
        """
        wrong = () if self.soundness.sound else (Doubt(WRONG, of_failed=not self.soundness.calibrated),)
        return (*wrong, *self.hidden[requirement.name])

    def notices(self) -> Iterator[Notice]:
        """What comes first in every report, if the model is wrong."""
        if not self.soundness.sound:
            cause = "; or ".join(self.soundness.suggestions)
            yield Notice(
                severity="error",
                what=f"{WRONG}: {cause and f'{cause}. This explains it: '}{'; '.join(self.soundness.reasons)}",
                remedy="correct it and process again" if cause else words.UNEXPLAINED,
            )
        if self.mute:
            yield Notice(
                severity="info",
                what=f"nothing in these recordings shows a response of {', '.join(self.mute)}, only noise",
                remedy="record a weight that is put on beside the axis, or a push, and look at this channel",
            )
        for name, doubts in self.hidden.items():
            if doubts:
                yield Notice(
                    severity="warning",
                    what="; ".join(one.why for one in doubts),
                    where=name,
                    remedy="what lies there is not judged: record anew, faster, without filter or gaps, correct what "
                    "is stated, or judge a lower band",
                )


@dataclass(frozen=True, slots=True, eq=False)
class _Evidence:
    """What was found of the model of a rig, before anything is said of it."""

    campaign: Campaign
    model: GravityModel
    samples: Sequence[Sample]
    instants: Sequence[Instants]
    conventions: Sequence[SignCheck]
    most: Array  # (c,) rms that gravity may leave of a calibration
    tension: Tension
    late: Sequence[Moved]  # lags that explain a good part of what gravity leaves
    misled: Mapping[Moved, Shift]  # what is misread in recordings that were not fitted
    gains: Sequence[Moved]  # of channels, as the others show them
    timed: Sequence[str]  # clocks and rates that are not as stated
    still: Sequence[str]  # encoders that stop
    twice: Sequence[str]  # recordings that are the same

    def reasons(self) -> tuple[str, ...]:
        """Return what contradicts the description, nothing where it is sound."""
        turning = turned(self.model.equation, self.instants)
        return (
            *self.timed,
            *self.still,
            *self.twice,
            *words.far(self.tension.beyond, self.tension.probability),
            *(f"{one.check} is {one.found}, expected {one.expected}" for one in self.conventions if not one.ok),
            *_left(self.model, self.most),
            *(words.TURNED.format(joint, np.exp(min(0.5 * rather, 300.0))) for joint, rather in turning),
        )

    def suggestions(self, reasons: Sequence[str]) -> tuple[list[str], bool]:
        """Return what explains the reasons; and whether the transducer is right all the same, by its calibration."""
        beyond, equation = self.tension.beyond, self.model.equation
        shifted = [one for one in beyond if one in self.late]
        told = [words.SCALE for _ in self.timed[:1]] + [words.STUCK for _ in self.still[:1]]
        told += [words.LATE.format(one.value) for one in shifted[:1]] + [words.TWICE for _ in self.twice[:1]]
        misled = {one: self.misled[one] for one in beyond if one in self.misled}
        along = {name for own in self.misled.values() for name in own.zeros}
        right = not (self.timed or self.still or shifted or self.twice) and self._calibrated()
        tests = [one.name for one in self.campaign.recordings if one.role != "calibration"]
        off = [one for one in self.conventions if not one.ok]
        alone = right and all(one.check.rpartition(", ")[2] in tests for one in off)
        single = len({one.channel for one in off if one.channel}) == 1  # what pulls is read by several
        regained = [one for one in off if single and one.followed > FOLLOWED]
        if right and misled and all(one in (*misled, *self.gains) or one.name in along for one in beyond):
            told += [words.misread(own, SILENT) for own in misled.values()]
        elif alone and regained:
            told += [
                words.regained(one.channel, one.slope or 0.0, one.check.rpartition(", ")[2], SILENT) for one in regained
            ]
        elif not self.twice and tuple(reasons) != (*self.timed, *self.still, *words.far(shifted, 1.0)):
            told += [words.cause(one, equation) for one in explanations(equation, self.instants, self.most)]
        pull = float(self.model.rig.gravity.value)
        if pull and not EARTH[0] < pull < EARTH[1]:
            told.insert(0, words.GRAVITY.format(pull))
        return told, alone and not misled and not regained and all(one.channel for one in off)

    def _calibrated(self) -> bool:
        """Whether there are calibrations, and they alone agree with what was known."""
        names = {entry.name for entry in self.campaign.recordings if entry.role == "calibration"}
        alone = [sample for sample in self.samples if sample.name in names]
        if not alone:
            return False
        by_these, equation = self.model, self.model.equation
        if names != set(self.model.taring):
            rig, inertia = equation.elements.rig, equation.include_inertia
            by_these = gravity.fit(alone, rig, include_inertia=inertia, settings=self.model.settings)
        return tension(by_these, {}).sound and not any(_left(by_these, self.most))


def check_model(campaign: Campaign, recordings: Sequence[Prepared], model: GravityModel, progress: Progress) -> Checked:
    """Compare what was fitted with what was known, and look for what would explain a difference."""
    with progress.task("Comparing the rig with what was known of it"):
        inputs = campaign, list(recordings), model
        return kept("check of the model", inputs, lambda: _checked(campaign, recordings, model))


def _checked(campaign: Campaign, recordings: Sequence[Prepared], model: GravityModel) -> Checked:
    tared = [
        tare(campaign, one.entry, relieved(campaign, one.entry, one.run, one.motion), one.motion, model)
        for one in recordings
    ]
    samples = [sample for sample, _ in tared]
    equation = model.equation
    low_pass, theta = model.settings.low_pass_Hz, model.fit.value[: equation.size]
    instants = [prepared(sample, equation, model.settings, low_pass, theta) for sample in samples]
    constants = np.stack([taring.bias for _, taring in tared])
    shown = [_read_and_due(one, data, model) for one, data in zip(recordings, instants, strict=True)]
    readings = [read for read, _, _ in shown]
    conventions = (*check_weight(campaign.rig), *_conventions(recordings, instants, model, constants, shown))
    tested = {one.channel for one in conventions if one.testable and one.channel}
    white = [measured_noise(model.rig, one)[1] for one in recordings]
    lags = [(one, own) for one, data in zip(recordings, instants, strict=True) if (own := lag(model, data))]
    late = [_late(campaign, one, own) for one, own in lags if own.taken >= TAKEN]
    misled = _misread_alone(model, instants, {sample.name for sample, taring in tared if taring.fitted})
    shows = shown_gains(equation, instants)
    gains = tuple(_read_gains(equation, {key: of for key, of in shows.items() if key not in tested}))
    evidence = _Evidence(
        campaign,
        model,
        samples,
        instants,
        conventions,
        _most(equation) if tested else _most_of_untested(equation, readings, white),
        tension(model, {sample.name: taring for sample, taring in tared}, (*late, *misled, *gains)),
        late,
        misled,
        gains,
        timed=tuple(mistimed(campaign, recordings)),
        still=tuple(stuck(recordings, instants, model)),
        twice=tuple(repeated(recordings)),
    )
    reasons = evidence.reasons()
    told, calibrated = evidence.suggestions(reasons) if reasons else ((), True)
    soundness = Soundness(
        sound=not reasons,
        probability=evidence.tension.probability,
        gains={key: sigma for key, (_, sigma, _) in shows.items()},
        beyond=tuple(words.beyond(one, model) for one in evidence.tension.beyond) if reasons else (),
        reasons=reasons,
        suggestions=tuple(told),
        calibrated=calibrated,
    )
    judged = {key for one in campaign.requirements for key in measurable.judged_channels(one, campaign.rig)}
    channels = model.rig.transducer.channels
    return Checked(
        soundness,
        conventions,
        hidden={one.name: tuple(_hidden(campaign, one, recordings, model)) for one in campaign.requirements},
        rounding={key: x for one in recordings for key, x in measurable.rounding(campaign, one.readings).items()},
        noise={
            one.entry.name: dict(zip(channels, rms.tolist(), strict=True))
            for one, rms in zip(recordings, white, strict=True)
        },
        mute=tuple(key for key in _mute(equation, readings) if key in judged),
        unconfirmed=tuple(key for key in equation.channels if key not in tested),
        late={own.recording: abs(own.value) for _, own in lags if abs(own.value) > BEYOND * own.chance},
    )


def _late(campaign: Campaign, one: Prepared, own: Shift) -> Moved:
    """A recording's lag next to what is known of its clocks."""
    known = late_sigma(one.run.clocks, campaign.rig.transducer.amplifier, one.entry.clock_sigma)
    return own.moved(max(KNOWN_S, known))


def _hidden(
    campaign: Campaign, requirement: Requirement, recordings: Sequence[Prepared], model: GravityModel
) -> Iterator[Doubt]:
    """What the samples cannot show of a requirement, and where it cannot be judged."""
    spacecraft = campaign.rig.spacecraft
    arm = np.inf if spacecraft is None else float(np.linalg.norm(spacecraft.position.value))
    if requirement.frame == "S" and 0.0 < arm < NEAR * extent(campaign.rig)[1]:
        yield Doubt(f"spacecraft.position is {arm:.3g} m from the transducer, within the article: look at its unit")
    yield from measurable.unrecorded(requirement, campaign.rig)
    judged = [one for one in recordings if one.entry.role != "calibration"]
    unclear = measurable.doubtful(campaign, [(one.entry, one.run) for one in judged], requirement.band[1])
    for one in judged:
        name = one.entry.name
        run = replace(one.run, stretches=tuple(unclear[name]))
        yield from measurable.hidden(campaign, requirement, name, run, one.motion.valid, one.readings)
    if campaign.rig.transducer.channels:
        edge = requirement.band[1]
        yield from unlike_stated(requirement, campaign.rig, judged)
        yield from copied(requirement, campaign.rig, recordings)
        yield from measurable.attenuated(campaign.rig.transducer.amplifier, edge)
        poses = [one.motion.q[at] for one in judged[:1] for at in (0, -1)]
        every = [mode.frequency for pose in poses for mode in modes(model.rig, select(campaign.effects), pose)]
        yield from measurable.amplified(every, edge)


def _conventions(
    recordings: Sequence[Prepared],
    instants: Sequence[Instants],
    model: GravityModel,
    zeros: Array,
    shown: Sequence[tuple[Array, Array, Array]],
) -> Iterator[SignCheck]:
    """Signs and responses of every recording; `zeros` (recordings, c) are its channels' constants."""
    equation = model.equation
    theta = equation.start()
    noise = equation.elements.rig.loads.noise[equation.index]
    every = zip(recordings, instants, _moved_alone(equation, zeros), shown, strict=True)
    for one, data, alone, (read, due, error) in every:
        errors = equation.jacobian(theta, data).reshape(*data.wrench.shape, equation.size) * equation.sigma()
        found = [*check_gravity_sign(equation.channels, data.wrench, equation.predict(theta, data), noise, errors)]
        found += check_response(equation.channels, read, due, error, noise, alone)
        command, angle = commanded(one.run), one.run.angle
        if command is not None and angle is not None:
            found += check_encoder_sense(angle, command)
        for check in found:
            yield msgspec.structs.replace(check, check=f"{check.check}, {one.entry.name}")


def _misread_alone(model: GravityModel, instants: Sequence[Instants], fitted: Collection[str]) -> dict[Moved, Shift]:
    """What is misread in recordings that were not fitted, as long as none of the `fitted` ones is."""
    found = {data.name: {own.moved(FINEST): own for own in misread(model, data)} for data in instants}
    return {} if any(found[name] for name in fitted) else {key: own for of in found.values() for key, own in of.items()}


def _moved_alone(equation: Equation, zeros: Array) -> Mask:
    """Which channel's zero (recordings, c) is off another recording's, far more than that of any other channel."""
    stated = np.maximum(equation.bias_sigma, 1e-12)
    moved = np.array([np.abs((zeros - own) / stated).max(axis=0) for own in zeros])
    others = np.array([np.delete(moved, column, axis=1).max(axis=1, initial=0.0) for column in range(moved.shape[1])])
    noise = equation.elements.rig.loads.noise[equation.index]
    alone: Mask = (moved > BEYOND * others.T) & (others.T > 0.0) & (moved * stated > BEYOND * noise)
    return alone


def _mute(equation: Equation, readings: Sequence[Array]) -> Iterator[str]:
    """Channels whose low-passed `readings` (n, c) vary by less than their noise in every recording."""
    noise = equation.elements.rig.loads.noise[equation.index]
    spread = np.max([read.std(axis=0) for read in readings], axis=0)
    yield from (key for key, size, least in zip(equation.channels, spread, noise, strict=True) if size < least)


def _read_and_due(one: Prepared, data: Instants, model: GravityModel) -> tuple[Array, Array, Array]:
    """Low-passed readings (n, c) as recorded, the same as the fitted rig has them, and the rms error (c,) of that."""
    equation, rig = model.equation, model.equation.elements.rig
    read = smooth(one.raw.values, one.raw.dt, model.settings.low_pass_Hz)[np.rint(data.t / data.dt).astype(np.intp)]
    index = [WRENCH_CHANNELS.index(channel) for channel in rig.transducer.channels]
    reads = np.eye(len(equation.channels))
    reads[: len(index), : len(index)] += rig.transducer.cross_coupling.value[np.ix_(index, index)]
    theta = model.fit.value[: equation.size]
    slopes = reads @ equation.jacobian(theta, data).reshape(*data.wrench.shape, equation.size)
    slopes -= slopes.mean(axis=0)
    C = model.fit.covariance[: equation.size, : equation.size]
    error = np.sqrt(np.maximum(np.einsum("nci,ij,ncj->c", slopes, C, slopes), 0.0) / len(slopes))
    return read, read - (data.wrench - equation.predict(theta, data)) @ reads.T, error


def _read_gains(equation: Equation, gains: Mapping[str, tuple[float, float, float]]) -> Iterator[Moved]:
    """What channels read of what acts, by all other channels, next to their calibration."""
    rig = equation.elements.rig
    stated = np.diag(rig.transducer.cross_coupling.sigma)
    for key, (value, sigma, rather) in gains.items():
        known = float(stated[WRENCH_CHANNELS.index(key)])
        chance = float(np.hypot(known, value * sigma))
        if sigma < SHOWN and rather > RATHER and value > 0.0:
            yield Moved(f"the gain of {key} by the other channels", 1.0, known, value, chance)


def _left(model: GravityModel, most: Array) -> Iterator[str]:
    """Channels of which gravity explains too little in the recordings that are there for it."""
    for name in model.reference:
        for channel, unit, rms, limit in zip(model.channels, model.units, model.residual_rms[name], most, strict=True):
            if rms > limit:
                yield f"gravity leaves {rms:.3g} {unit} rms of {channel} in {name}"


def extent(rig: Rig) -> tuple[float, float]:
    """Weight (N) of all bodies, and how far from T's origin (m) a centre of mass may be, at most by what is stated."""
    most = [(body.mass.value + BEYOND * body.mass.sigma, body.cog.value, body.cog.sigma) for body in rig.bodies]
    arms = [float(np.linalg.norm(joint.origin.value)) for joint in rig.joints]
    reach = max((float(np.linalg.norm(np.abs(at) + BEYOND * sigma)) for _, at, sigma in most), default=0.0)
    return float(rig.gravity) * float(sum(mass for mass, _, _ in most)), sum(arms) + reach


def _most(equation: Equation) -> Array:
    """What may be left (c,) of a calibration, rms: a part of the weight, and of the torque that it can make."""
    weight, reach = extent(equation.elements.rig)
    by_kind = {"F": weight, "T": weight * reach}
    scale = np.array([by_kind[key[0]] if key in WRENCH_CHANNELS else 0.0 for key in equation.channels])
    most: Array = np.where(scale > 0.0, LEFT * scale, np.inf)
    return most


def _most_of_untested(equation: Equation, readings: Sequence[Array], white: Sequence[Array]) -> Array:
    """The same where no load tests a channel: what gravity leaves may be gravity about another axis."""
    spread = np.max([read.std(axis=0) for read in readings], axis=0)
    floor = equation.elements.rig.loads.noise[equation.index]
    channels = len(equation.elements.rig.transducer.channels)
    floor[:channels] = np.nanmax([floor[:channels], *white], axis=0)  # stated, and as measured
    most: Array = np.minimum(_most(equation), np.maximum(LEFT * spread, BEYOND * floor))
    return most
