"""Is the model of the rig right? What was fitted against what was known, before anything is judged by it.

`validate` and processing ask the same here: every fitted number against its prior, each recording's zero, the slope of
what is read against computed loads, and what a calibration leaves. Where one of them is beyond what chance allows,
no requirement is met; what a simple fault would explain is said first.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import msgspec
import numpy as np

from kbs_process.campaign.config import Campaign, Requirement
from kbs_process.plant.laws import select
from kbs_process.plant.linear.modes import modes
from kbs_process.plant.rigid import static_wrench
from kbs_process.progress import Progress
from kbs_process.reduction import measurable
from kbs_process.reduction.held import noisy
from kbs_process.reduction.preparing import Prepared, tare
from kbs_process.reduction.relief import relieved
from kbs_process.results.judged import WRONG, Beyond, Doubt, Soundness
from kbs_process.results.records import Notice
from kbs_process.rig.model import Rig
from kbs_process.signals.records import WRENCH_CHANNELS, Array, Mask, Run
from kbs_process.signals.smoothing import smooth
from kbs_process.stages.align.clocks import late_sigma
from kbs_process.stages.align.prints import Prints, again
from kbs_process.stages.align.readings import white
from kbs_process.stages.align.spectrum import OCTAVES, quietest
from kbs_process.stages.conventions import (
    BEYOND,
    SignCheck,
    check_encoder_sense,
    check_gravity_sign,
    check_response,
    check_weight,
)
from kbs_process.stages.gravity import model as gravity
from kbs_process.stages.gravity.equation import Equation, encoder_offsets
from kbs_process.stages.gravity.equation import Prepared as Instants
from kbs_process.stages.gravity.hypotheses import Explained, explanations, shown_gains
from kbs_process.stages.gravity.model import GravityModel, Sample, prepared
from kbs_process.stages.gravity.tension import BY_CHANCE, TAKEN, Moved, lag, tension
from kbs_process.stages.repeats import commanded, copies, motion_of

LEFT = 0.1  # of the weight, and of the torque that it can make: a calibration leaves less, whatever rubs or pulls
UNLIKE = 3.0  # times less noise than is stated, or more, however well it is known
SILENT = 0.1  # slope, against computed loads, of a channel that does not respond
RATED = 1.1  # times: angles that change by more, or by less than its inverse, do not follow their rates
_SCALE = "clock: the times of all streams run too fast or too slow, or rates are in another unit"
_TOLD = 1e-3  # rad: a joint that commands move by less rests
_STUCK = "encoder: it is not read, or does not turn with its joint"
_TWICE = "mapping: one column is read for two channels"
_LATE = "clock: the wrench is {:+.2g} s late, by its timestamps or a filter"
_UNEXPLAINED = (
    "no single simple fault (gain, unit, sign, axis, zero, swapped channels, one number) explains it: look for what "
    "else pulls or rubs, and compare the parameter files with the rig"
)
_LIKE = 0.03  # relative: a gain this near to a unit's factor is that unit's
_SHOWN = 6
_TURN = 72  # angles of a turn
_UNCHANGED = 1e-3  # of the largest load that a turn changes: less is none
_SAME = 1e-12  # relative: what rounding makes of the same reading
_FORCES = {"pound-force": 4.4482216, "kilogram-force": 9.80665, "gram-force": 9.80665e-3, "kN": 1e3, "mN": 1e-3}
_TORQUES = {
    "N mm": 1e-3,
    "N cm": 1e-2,
    "pound-force foot": 1.3558179,
    "pound-force inch": 0.1129848,
    "kilogram-force metre": 9.80665,
    "kN m": 1e3,
}


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
                remedy="correct it and process again" if cause else _UNEXPLAINED,
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


def check_model(campaign: Campaign, recordings: Sequence[Prepared], model: GravityModel, progress: Progress) -> Checked:
    """Compare what was fitted with what was known, and look for what would explain a difference."""
    with progress.task("Comparing the rig with what was known of it"):
        tared = [
            tare(campaign, one.entry, relieved(campaign, one.entry, one.run, one.motion), one.motion, model)
            for one in recordings
        ]
        samples = [sample for sample, _ in tared]
        equation = model.equation
        low_pass, theta = model.settings.low_pass_Hz, model.fit.value[: equation.size]
        instants = [prepared(sample, equation, model.settings, low_pass, theta) for sample in samples]
        zeros = np.stack([taring.bias for _, taring in tared])
        shown = [_read_and_due(one, data, model) for one, data in zip(recordings, instants, strict=True)]
        conventions = (*check_weight(campaign.rig), *_conventions(recordings, instants, model, zeros, shown))
        amplifier = campaign.rig.transducer.amplifier
        lags = [(one, own) for one, data in zip(recordings, instants, strict=True) if (own := lag(model, data))]
        known = [late_sigma(one.run.clocks, amplifier, one.entry.clock_sigma) for one, _ in lags]
        late = [own.moved(sigma) for (_, own), sigma in zip(lags, known, strict=True) if own.taken >= TAKEN]
        found = tension(model, {sample.name: taring for sample, taring in tared}, late)
        tested = {one.channel for one in conventions if one.testable and one.channel}
        most = _most(equation)
        if not tested:  # what gravity leaves may be gravity about another axis
            spread = np.max([read.std(axis=0) for read, _, _ in shown], axis=0)
            most = np.minimum(
                most, np.maximum(LEFT * spread, BEYOND * equation.elements.rig.loads.noise[equation.index])
            )
        rounding = {key: x for one in recordings for key, x in measurable.rounding(campaign, one.readings).items()}
        channels = model.rig.transducer.channels
        noise = {
            one.entry.name: dict(zip(channels, measured_noise(model.rig, one)[1].tolist(), strict=True))
            for one in recordings
        }
        hidden = {one.name: tuple(_hidden(campaign, one, recordings, model)) for one in campaign.requirements}
        timed = tuple(mistimed(campaign, recordings))
        still = tuple(stuck(recordings, instants, model))
        twice = tuple(repeated(recordings))
        reasons = (
            *timed,
            *still,
            *twice,
            *_far(found.beyond, found.probability),
            *(f"{one.check} is {one.found}, expected {one.expected}" for one in conventions if not one.ok),
            *_left(model, most),
        )
        judged = {key for one in campaign.requirements for key in measurable.judged_channels(one, campaign.rig)}
        mute = tuple(_mute(equation, [read for read, _, _ in shown]))
        failed = [one.check.split() for one in conventions if not one.ok and abs(one.slope or 0.0) < SILENT]
        dead = [key for key in mute if any(key in words for words in failed)]
        gains = shown_gains(equation, instants)
        soundness = Soundness(probability=found.probability, gains=gains)
        tests = [one.entry.name for one in recordings if one.entry.role != "calibration"]
        if reasons:
            shifted = [one for one in found.beyond if one in late]
            told = [_SCALE for _ in timed[:1]] + [_STUCK for _ in still[:1]]
            told += [_LATE.format(one.value) for one in shifted[:1]] + [_TWICE for _ in twice[:1]]
            more = not twice and reasons != (*timed, *still, *_far(shifted, 1.0))
            causes = explanations(equation, instants, most) if more else ()
            if dead and not any(one.fault.kind in ("swapped", "axes") for one in causes):  # which leave one silent
                causes, told = (), told + [f"channel: {key} does not respond" for key in dead]
            told += [_in_words(one, equation) for one in causes]
            soundness = Soundness(
                sound=False,
                probability=found.probability,
                gains=gains,
                beyond=tuple(_beyond(one, model) for one in found.beyond),
                reasons=reasons,
                suggestions=tuple(told),
                calibrated=not (timed or still or shifted or twice)
                and _calibrated(campaign, samples, model, most)
                and all(one.ok or (one.channel and one.check.rpartition(", ")[2] in tests) for one in conventions),
            )
        silent = tuple(key for key in mute if key in judged)
        unconfirmed = tuple(key for key in equation.channels if key not in tested)
        lag_of = {own.recording: abs(own.value) for _, own in lags if abs(own.value) > BEYOND * own.chance}
        return Checked(soundness, conventions, hidden, rounding, noise, silent, unconfirmed, lag_of)


def _hidden(
    campaign: Campaign, requirement: Requirement, recordings: Sequence[Prepared], model: GravityModel
) -> Iterator[Doubt]:
    """What the samples cannot show of a requirement."""
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


def unlike_stated(requirement: Requirement, rig: Rig, recordings: Sequence[Prepared]) -> Iterator[Doubt]:
    """Channels with far less white noise than is stated, and those with far more, unless rounding hides it (`noisy`).

    What averages or filters readings takes noise off as it takes off peaks: next to the band, in the octaves above it.
    Noise is more where it is so up to half the sampling rate, and from sample to sample.
    """
    own, stated, amplifier = rig.transducer.channels, noisy(rig), rig.transducer.amplifier
    judged = measurable.needed_channels(requirement, rig)
    near = min(2.0**OCTAVES * requirement.band[1], np.inf if amplifier is None else float(amplifier.corner))
    index = rig.loads.index(own)
    noise = np.array([stated.get(channel, np.nan) if channel in judged else np.nan for channel in own])
    sigma = rig.transducer.noise.sigma[index]
    factor = np.maximum(UNLIKE, np.exp(np.minimum(BEYOND * sigma / noise, 100.0)))  # beyond, nothing is known
    for one in recordings:
        less, more = measured_noise(rig, one, near)
        for off, read, why in (
            (factor * less < noise, less, "averaged or filtered before it was stored, or in another scale"),
            (more > factor * noise, more, "disturbed, or in another scale"),
        ):
            told = [
                f"{own[k]} has {read[k]:.2g} {rig.loads.units[index[k]]} rms, not {noise[k]:.2g} +- {sigma[k]:.2g}"
                for k in np.flatnonzero(off)
            ]
            if told:
                yield Doubt(f"the noise is not as stated in {one.entry.name}: {', '.join(told)}: {why}")


def measured_noise(rig: Rig, one: Prepared, near: float = np.inf) -> tuple[Array, Array]:
    """White noise (c,) of each recorded channel, rms: in the octaves below `near`, Hz; in all, and between samples.

    NaN where nothing tells.
    """
    index = rig.loads.index(rig.transducer.channels)
    if (spectrum := one.run.spectrum) is None or "wrench" not in one.readings:
        return np.full(len(index), np.nan), np.full(len(index), np.nan)
    reads = np.eye(len(index)) + rig.transducer.cross_coupling.value[np.ix_(index, index)]
    raw, rate = replace(spectrum, S=reads @ spectrum.S @ reads.T), one.run.rates["wrench"]
    first = white(np.concatenate(one.readings["wrench"].head))
    return quietest(raw, rate, near), np.minimum(quietest(raw, rate, np.inf), first)


def copied(requirement: Requirement, rig: Rig, recordings: Sequence[Prepared]) -> Iterator[Doubt]:
    """Runs of readings that come twice, rounded anew or not, of channels whose noise is more than rounding moves them.

    Recordings that are the same throughout, motion and all, are one: `told_copies` tells of that.
    """
    own, stated = rig.transducer.channels, noisy(rig)
    noise = np.stack([measured_noise(rig, one)[1] for one in recordings])
    found: dict[tuple[int, int], dict[str, tuple[int, int]]] = {}
    for place, channel in enumerate(own):
        if channel in stated and channel in measurable.needed_channels(requirement, rig):
            prints = [one.prints[place] if one.prints else Prints() for one in recordings]
            for pair, span in again(prints, np.minimum(noise[:, place], stated[channel])).items():
                found.setdefault(pair, {})[channel] = span
    for (first, second), spans in sorted(found.items()):
        one, other = recordings[first], recordings[second]
        if {one.entry.role, other.entry.role} == {"calibration"} or (one is not other and _same(one, other)):
            continue
        begin, end = (
            (at(stamps) - other.run.epoch_ns) * 1e-9
            for at, stamps in zip((min, max), zip(*spans.values(), strict=True), strict=True)
        )
        where = "at another time of it" if one is other else f"in {one.entry.name}"
        yield Doubt(
            f"readings of {', '.join(spans)} in {other.entry.name}, from {begin:.1f} s to {end:.1f} s, come "
            f"{where} as well: noise does not repeat, so they were copied"
        )


def _same(one: Prepared, other: Prepared) -> bool:
    """Whether two recordings read the same and move the same, from beginning to end."""
    a, b = motion_of(one.run), motion_of(other.run)
    return bool(copies([one.run, other.run])) and (a is None or b is None or np.array_equal(a.values, b.values))


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


def stuck(recordings: Sequence[Prepared], instants: Sequence[Instants], model: GravityModel) -> Iterator[str]:
    """Turning joints whose angle stands still, while the load changes as it would if they turned.

    What gravity leaves (n, c), over the noise, is far more than in other recordings, is such as a turn of the joint
    changes, and a good part of that: a blow is less, and what pulls or pushes has a force. A joint that was told to
    rest does.
    """
    equation, rig = model.equation, model.rig
    channels = rig.transducer.channels
    index = [WRENCH_CHANNELS.index(channel) for channel in channels]
    noise = np.maximum(rig.transducer.noise.value[index], 1e-12)
    elsewhere = {name: _power(rms[None, : len(channels)] / noise) for name, rms in model.residual_rms.items()}
    for one, data in zip(recordings, instants, strict=True):
        left = data.wrench - equation.predict(model.fit.value[: equation.size], data)
        left = (left - left.mean(axis=0))[:, : len(channels)] / noise
        power = _power(left)
        least = BEYOND**2 * max((x for name, x in elsewhere.items() if name != one.entry.name), default=0.0)
        for j, joint in enumerate(rig.joints):
            moved = np.ptp(data.q[:, j]) > gravity.STILL * max(float(data.sigma_q[:, j].max()), 1e-6)
            if moved or _rests(joint.name, one.run) or joint.type != "revolute" or power <= least:
                continue
            poses = np.tile(data.q.mean(axis=0) - encoder_offsets(rig), (_TURN, 1))
            poses[:, j] += 2.0 * np.pi * np.arange(_TURN) / _TURN
            turned = static_wrench(rig, poses)[:, index] / noise
            turned -= turned.mean(axis=0)
            size, along = np.linalg.svd(turned, full_matrices=False)[1:]
            along = along[size > _UNCHANGED * size[0]]
            within = LEFT**2 * _power(turned) < power <= float(np.max(np.sum(turned**2, axis=1)))
            if within and _power(left - left @ along.T @ along) < TAKEN * power:
                yield f"the angle of {joint.name} is still in {one.entry.name}, and the load changes as if it turned"


def _rests(joint: str, run: Run) -> bool:
    """Whether commands say that a joint does not turn."""
    told = commanded(run)
    return told is not None and joint in told.channels and bool(np.ptp(told.column(joint)) < _TOLD)


def _power(x: Array) -> float:
    """Mean square length of the rows of x (n, c)."""
    return float(np.mean(np.sum(x**2, axis=1)))


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


def repeated(recordings: Sequence[Prepared]) -> Iterator[str]:
    """Channels and joints that repeat another one, reading by reading: from another zero, or the other way."""
    for one in recordings:
        for signal in (one.raw, one.run.angle):
            if signal is None or not signal.valid.any():
                continue
            values = signal.values[signal.valid] - signal.values[signal.valid][0]
            least = _SAME * np.abs(signal.values[signal.valid]).max(0)
            for (a, x), (b, y) in combinations(enumerate(values.T), 2):
                apart = min(np.abs(x - y).max(), np.abs(x + y).max())
                if apart <= max(least[a], least[b]) < min(np.ptp(x), np.ptp(y)):
                    names = signal.channels
                    yield f"{names[b]} repeats {names[a]} in {one.entry.name}: one stream is read twice"


def mistimed(campaign: Campaign, recordings: Sequence[Prepared]) -> Iterator[str]:
    """Angles that change faster or slower than their rates say; commands without rates in another cycle than stated.

    The true slope lies between both regressions, whatever noise is in either.
    """
    cycle = campaign.rig.controller.cycle if campaign.drive == "command" and campaign.rig.controller else 0.0
    for one in recordings:
        for what, moved, due in _paces(one.run, float(cycle)):
            both = float(moved @ due)
            if both > 0.0 and not both < RATED * min(due @ due, moved @ moved):
                times = float(np.sqrt((moved @ moved) / (due @ due)))
                yield f"{what} in {one.entry.name} is {times:.3g}, expected 1"


def _paces(run: Run, cycle: float) -> Iterator[tuple[str, Array, Array]]:
    """Steps (n,) by what changes from sample to sample, and as they are due by rates, or by the stated `cycle`, s."""
    if run.command is not None and len(run.command.t) > 1:
        step = np.diff(run.command.t)
        column = dict(zip(run.command.channels, run.command.values.T, strict=True))
        rates = {name.removesuffix(".rate"): x for name, x in column.items() if name.endswith(".rate") and x.any()}
        for joint, x in rates.items():
            yield f"slope of command {joint} against its rate", np.diff(column[joint]), x[:-1] * step
        if cycle and not rates:
            yield "interval of commands over controller.cycle", np.atleast_1d(np.median(step)), np.array([cycle])
    if run.angle is not None and run.rate is not None:
        known = run.angle.valid & run.rate.valid
        for joint in (name for name in run.angle.channels if name in run.rate.channels):
            moved = np.gradient(run.angle.column(joint), run.angle.dt)[known]
            yield f"slope of angle {joint} against its rate", moved, run.rate.column(joint)[known]


def _far(beyond: Sequence[Moved], probability: float) -> Iterator[str]:
    for one in beyond[:_SHOWN]:
        known = f"{one.prior:.4g} +- {one.prior_sigma:.2g} by what is known"
        yield f"{one.name} is {one.value:.4g} by the fit, {known}: {abs(one.distance):.1f} sigma"
    if len(beyond) > _SHOWN:
        yield f"{len(beyond) - _SHOWN} other numbers are as far off"
    if probability < BY_CHANCE and not beyond:
        yield f"all fitted numbers together: chance moves them so far with a probability of {probability:.1g} only"


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


def _calibrated(campaign: Campaign, samples: Sequence[Sample], model: GravityModel, most: Array) -> bool:
    """Whether there are calibrations, and they alone agree with what was known."""
    names = {entry.name for entry in campaign.recordings if entry.role == "calibration"}
    alone = [sample for sample in samples if sample.name in names]
    if not alone:
        return False
    by_these, equation = model, model.equation
    if names != set(model.taring):
        rig, inertia = equation.elements.rig, equation.include_inertia
        by_these = gravity.fit(alone, rig, include_inertia=inertia, settings=model.settings)
    return tension(by_these, {}).sound and not any(_left(by_these, most))


def _beyond(one: Moved, model: GravityModel) -> Beyond:
    quantity = model.equation.elements.rig.quantities().get(one.name.split("[")[0])
    channel = one.name.rpartition("].")[2]
    unit = dict(zip(model.channels, model.units, strict=True)).get(channel, "") if quantity is None else quantity.unit
    return Beyond(
        name=one.name, unit=unit, prior=one.prior, prior_sigma=one.prior_sigma, value=one.value, distance=one.distance
    )


def _in_words(one: Explained, equation: Equation) -> str:
    fault, found = one.fault, one.found
    match fault.kind:
        case "gain":
            return _gain(fault.what, fault.gained, float(found[0]))
        case "swapped":
            return f"swapped: {fault.what}"
        case "axes":
            return f"axes: the transducer's x, y, z are read as {fault.what}"
        case "sense":
            return f"sign: the angle of {fault.what} turns the other way, by its axis or its encoder's sign"
        case "unit":
            return f"unit: {fault.what}"
        case "clock":
            return f"clock: all times are {np.sqrt(found[0]):.3g} of what passes, by a wrong rate or unit of time"
        case "zero":
            return f"zero: the angle of {fault.what} is {np.degrees(found[0]):.4g} degrees too large"
        case "point":
            return (
                f"axis: torques are about another point than stated, off by ({', '.join(f'{x:.4g}' for x in found)}) m"
            )
        case "bias":
            return f"zero: that of {fault.what} is not as stated ({_values(found)} for {_values(one.stated)})"
        case _:
            return f"{fault.what} is {_values(found)}, for {_values(one.stated)} as stated"


def _values(numbers: Array) -> str:
    return ", ".join(f"{x:.4g}" for x in numbers[:_SHOWN]) + (", ..." if len(numbers) > _SHOWN else "")


def _gain(what: str, channels: Sequence[str], gain: float) -> str:
    """A gain in words: as a sign, as a unit, or as it is."""
    if abs(gain + 1.0) < _LIKE:
        return f"sign: {what} negated"
    units = _FORCES if all(name[0] == "F" for name in channels) else _TORQUES
    if any(name[0] == "F" for name in channels) and any(name[0] == "T" for name in channels):
        units = {}
    for name, factor in units.items():
        stated = "N m" if units is _TORQUES else "N"
        if abs(gain * factor - 1.0) < _LIKE:
            return f"unit: {what} in {name}, taken for {stated}"
        if abs(gain / factor - 1.0) < _LIKE:
            return f"unit: {what} in {stated}, taken for {name}"
    return f"gain: {what} read {gain:.4g} of what acts"
