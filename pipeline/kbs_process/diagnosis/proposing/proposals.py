"""Where the residual has lines: frequencies, and orders of motors' turns, for suspects whose grid only data give."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.fft import fft, next_fast_len

from kbs_process.diagnosis.experiments.thresholds import LINE_ALPHA, LINES
from kbs_process.diagnosis.nominal.known import Known
from kbs_process.diagnosis.proposing.folding import periods
from kbs_process.diagnosis.proposing.sweeps import sweeping
from kbs_process.diagnosis.screening.ranges import by_parameter
from kbs_process.diagnosis.screening.scene import Scene
from kbs_process.diagnosis.side_by_side import side_by_side
from kbs_process.signals.records import Array

_HIGHEST_ORDER = 420.0  # of a motor: twice the teeth's passing and what lies around it
_ORDER_STEP = 0.25
_HIGHEST_OF_DISC = 1000.0  # of an encoder's disc: beyond it a code's interpolation is looked for
_HIGHEST_OF_JOINT = 500.0  # of a joint: twice the teeth of its gear, and what lies around it
_FASTEST = 0.999  # share of the steps between samples, beyond which a gap lies
_FINE = 8.0  # steps of an order that a line of a joint's range is wide
_SAMPLES = 100  # while a joint moves, fewer of which show no line along its angle
_TURNS = 10.0  # of a tone in a recording, fewer of which are drift, or the motion
_CELLS = 20  # of an angle to a turn of the highest order
_MOVING = 1e-3  # rad/s of a motor
_PASSING = 1e-5  # rad/s of a joint
_NEAR_WHOLE = 0.02  # of a number of periods in an electrical cycle
_OF_ITS_SHAPE = 8.0  # periods in a disc's turn: more of them are lines of its grating, read between
_BETWEEN = 33  # frequencies in two bins
LONGEST_BEAT = 32  # cycles of a controller, after which what comes late comes late again
_PLACES = 400  # that a joint's range is divided into
_WIDEST = 0.1  # of the range, of what has a place
_SEEN = 20.0  # samples at a place, fewer of which count as that many


def proposed(known: Known, scene: Scene) -> dict[str, tuple[float, ...]]:
    """Values to try beside the grids: parameter name, of one site "name.site" -> values that residuals propose."""
    lines, tone = _frequencies(known), _sweep(known)
    # Kind of proposal, and joint if it is one's -> values.
    found: dict[tuple[str, str], tuple[float, ...]] = {("tone", ""): lines, ("beat", ""): _beats(known, lines)}
    found["swept tone", ""] = lines
    if tone is not None:
        found |= {("swept tone", ""): (*lines, tone[0]), ("sweep", ""): (tone[1],)}
    of_joints = _of_joints(known, scene)
    for joint, orders in _orders(known, scene).items():
        found["motor order", joint] = _in_turns_of_the_motor(known, joint, orders, of_joints.get(joint, ()))
        found["cycle order", joint] = _of_cycles(known, joint, orders)
    found |= _between_lines(known, _of_discs(known))
    found |= {("period", joint): values for joint, values in periods(known, scene).items()}
    found |= {("joint order", joint): values for joint, values in of_joints.items()}
    for joint, (angle, width) in _local(known, scene).items():
        # What has been passed rings on for a while.
        found |= {("place", joint): (angle - width, angle, angle + width), ("width", joint): (width,)}
    return by_parameter(found)


def _sweep(known: Known) -> tuple[float, float] | None:
    """Frequency at the start and sweep of the strongest tone of all recordings that runs up or down."""
    experiment = known.experiment

    def tone_of(k: int) -> tuple[float, float, float] | None:
        return sweeping(_in_time(known, k), experiment.dt, experiment.highest_Hz)

    tones = [tone for tone in side_by_side(tone_of, experiment.fit) if tone is not None]
    shortest = min(len(experiment.trials[k].valid) for k in experiment.fit) * experiment.dt
    slow = _TURNS / shortest
    tones = [tone for tone in tones if min(tone[1], tone[1] + tone[2] * shortest) > slow]
    return max(tones)[1:] if tones else None


def _frequencies(known: Known) -> tuple[float, ...]:
    """Frequencies at which the whitened residual stands out of its neighbours, Hz."""
    total: dict[int, tuple[Array, Array]] = {}
    for k in known.experiment.fit:
        layout = known.metric[k].layout(known.residual[k])
        power = np.sum(layout**2, axis=0)
        f = known.metric[k].whiten.f
        best = power.max(axis=1)
        total[k] = f, best
    shortest = min(len(known.experiment.trials[k].valid) for k in total) * known.experiment.dt
    found: list[tuple[float, float]] = []
    for k, (f, best) in total.items():
        bound = -2.0 * np.log(LINE_ALPHA / (len(f) * len(total)))
        peaks = np.flatnonzero((best[1:-1] >= best[:-2]) & (best[1:-1] >= best[2:]) & (best[1:-1] > bound)) + 1
        series = _in_time(known, k)
        found += [
            (float(best[i]), _between_bins(series, known.experiment.dt, float(f[i])))
            for i in sorted(peaks, key=lambda i: -best[i])[:LINES]
            if f[i] * shortest > _TURNS
        ]
    return _apart([value for _, value in sorted(found, reverse=True)], 0.05)


def _beats(known: Known, lines: tuple[float, ...]) -> tuple[float, ...]:
    """Lines, each after the shortest beat of the controller's cycles that lies within a bin of it.

    The motion widens such a line, or splits it: it is not where most power is.
    """
    experiment = known.experiment
    if experiment.rig.controller is None:
        return lines
    cycle = float(experiment.rig.controller.cycle)
    apart = 1.0 / (max(len(experiment.trials[k].valid) for k in experiment.fit) * experiment.dt)
    found = []
    for line in lines:
        beats = [round(line * n * cycle) / (n * cycle) for n in range(1, LONGEST_BEAT + 1)]
        near = [beat for beat in beats if beat > 0.0 and abs(beat - line) < apart]
        found += [*near[:1], line]
    return tuple(dict.fromkeys(found))


def _between_bins(series: Array, dt: float, f: float) -> float:
    """Frequency of the line nearest to f, Hz, at which a series (n, c) has most power: between its bins, too.

    Half a bin beside a tone more than half of its power is lost.
    """
    n = len(series)
    near = f + np.linspace(-1.0, 1.0, _BETWEEN) / (n * dt)
    turned = np.exp(-2j * np.pi * np.outer(near, np.arange(n) * dt)) @ series
    return float(near[np.argmax(np.max(np.abs(turned), axis=1))])


def _orders(known: Known, scene: Scene) -> dict[str, tuple[float, ...]]:
    """Orders of each joint's motor turns at which the whitened residual stands out.

    The residual in time, white, against exp(i order theta): a line's power is chi-square with two degrees of freedom.
    """
    experiment = known.experiment
    orders = np.arange(_ORDER_STEP, _HIGHEST_ORDER, _ORDER_STEP)
    found: dict[str, list[tuple[float, float]]] = {joint: [] for joint in experiment.rig.joint_names}
    for k in experiment.fit:
        trial = experiment.trials[k]
        drive = experiment.reference(trial.trajectory)
        if drive not in scene.signals:
            continue
        series = _in_time(known, k)
        signals = scene.signals[drive]
        t = np.arange(len(series)) * experiment.dt
        own = np.arange(len(signals.values)) / signals.rate
        for joint in experiment.rig.joint_names:
            angle = np.interp(t, own, _column(signals.columns, signals.values, f"rotor_angle.{joint}"))
            moves = (np.abs(np.gradient(angle, experiment.dt)) > _MOVING) & trial.valid
            if np.count_nonzero(moves) < _SAMPLES or np.ptp(angle[moves]) < 1.8 * np.pi:
                continue
            power = _along(orders, angle[moves], series[moves])
            # Lines that turn faster than the working rate shows are seen as others.
            fastest = 2.0 * np.pi * experiment.highest_Hz / np.max(np.abs(np.gradient(angle, experiment.dt)))
            power[orders > 10.0 * fastest] = 0.0
            bound = -np.log(LINE_ALPHA / (len(orders) * series.shape[1] * len(experiment.fit)))
            inner = power[1:-1]
            peaks = np.flatnonzero((inner >= power[:-2]) & (inner >= power[2:]) & (inner > bound)) + 1
            found[joint] += [(float(power[i]), float(np.round(orders[i] * 2.0) / 2.0)) for i in peaks]
    return {joint: _apart([value for _, value in sorted(lines, reverse=True)], 0.5) for joint, lines in found.items()}


def _in_turns_of_the_motor(
    known: Known, joint: str, orders: tuple[float, ...], lines: tuple[float, ...]
) -> tuple[float, ...]:
    """Orders of a motor, and its joint's: what is periodic in the motor's turns may be so in the output's, too.

    A ripple whose depth changes as the output turns has lines beside its own. Without a gear both are one, and the
    joint's are found in less than a turn, but not so exactly that a whole number would be told.
    """
    drive = known.experiment.rig.joint(joint).drive
    if drive is None or not float(drive.ratio) > 1.0:
        return orders or tuple(dict.fromkeys(order for line in lines for order in (float(round(line)), line)))
    return (*orders, *(line / float(drive.ratio) for line in lines))


def _of_cycles(known: Known, joint: str, orders: tuple[float, ...]) -> tuple[float, ...]:
    """Those orders of a motor that are whole numbers of periods in its electrical cycle, as such."""
    drive = known.experiment.rig.joint(joint).drive
    cycles = 0.0 if drive is None else float(drive.parameters.get("Kangle", 0.0))
    periods = [order / cycles for order in orders if cycles > 0.0]
    whole = [float(round(one)) for one in periods if abs(one - round(one)) < _NEAR_WHOLE]
    return tuple(dict.fromkeys(one for one in whole if one > 0.0))


def _of_joints(known: Known, scene: Scene) -> dict[str, tuple[float, ...]]:
    """Orders of each joint's own angle at which the whitened residual stands out: balls, teeth and slots that pass.

    A joint that turns in a range has lines as wide as a turn over that: they need not be whole numbers. One that turns
    all round comes to where it was.
    """
    experiment, found = known.experiment, dict[str, tuple[float, ...]]()
    for joint in experiment.rig.joint_names:
        lines: list[tuple[float, float]] = []
        for angle, series in _passed(known, scene, joint):
            if len(angle) < _SAMPLES:
                continue
            width = 2.0 * np.pi / np.ptp(angle)
            step = np.quantile(np.abs(np.diff(angle)), _FASTEST)
            fastest = 2.0 * np.pi * experiment.highest_Hz * experiment.dt / step
            # Less than two turns in the range is an offset and a slope.
            round_ = width <= 1.0
            first, apart = (np.ceil(2.0 * width), 1.0) if round_ else (2.0 * width, width / _FINE)
            orders = np.arange(first, min(_HIGHEST_OF_JOINT, fastest), apart)
            if len(orders) < 2:
                continue
            power = _along(orders, angle, series)
            bound = -np.log(LINE_ALPHA / (len(orders) * series.shape[1] * len(experiment.fit)))
            inner = power[1:-1]
            peaks = np.flatnonzero((inner >= power[:-2]) & (inner >= power[2:]) & (inner > bound)) + 1
            if round_:
                peaks = np.flatnonzero(power > bound)  # neighbours are orders of their own
            lines += [(float(power[i]), float(orders[i])) for i in peaks]
        found[joint] = _apart([value for _, value in sorted(lines, reverse=True)], 0.99)
    return found


def _passed(known: Known, scene: Scene, joint: str) -> Iterator[tuple[Array, Array]]:
    """Angles (n,) of a joint and the whitened residual (n, c) in time while it moves, of every trial that is fitted."""
    experiment = known.experiment
    for k in experiment.fit:
        drive = experiment.reference(experiment.trials[k].trajectory)
        if drive not in scene.signals:
            continue
        signals, series = scene.signals[drive], _in_time(known, k)
        t = np.arange(len(series)) * experiment.dt
        own = np.arange(len(signals.values)) / signals.rate
        angle = np.interp(t, own, _column(signals.columns, signals.values, f"joint_angle.{joint}"))
        moves = (np.abs(np.gradient(angle, experiment.dt)) > _PASSING) & experiment.trials[k].valid
        yield angle[moves], series[moves]


def _local(known: Known, scene: Scene) -> dict[str, tuple[float, float]]:
    """Middle and half width of the stretch of each joint's angles in which most of the whitened residual's power is.

    What is local passes whenever the joint passes there, and moves nothing elsewhere. Of all stretches up to a tenth
    of the range it is the one whose power stands out most, in standard deviations of as many of the other samples.
    """
    experiment, found = known.experiment, dict[str, tuple[float, float]]()
    for joint in experiment.rig.joint_names:
        passed = list(_passed(known, scene, joint))
        angle = np.concatenate([*(one for one, _ in passed), np.zeros(0)])
        power = np.concatenate([*(np.sum(series**2, axis=1) for _, series in passed), np.zeros(0)])
        if len(angle) > _PLACES and np.ptp(angle) > 0.0:
            found[joint] = _stretch(angle, power)
    return found


def _stretch(angle: Array, power: Array) -> tuple[float, float]:
    """Middle and half width of the stretch of angles (n,) in which power (n,) stands out most."""
    edges = np.linspace(angle.min(), angle.max(), _PLACES + 1)
    place = np.clip(np.searchsorted(edges, angle, side="right") - 1, 0, _PLACES - 1)
    count = np.concatenate([[0.0], np.cumsum(np.bincount(place, minlength=_PLACES))])
    total = np.concatenate([[0.0], np.cumsum(np.bincount(place, power - power.mean(), minlength=_PLACES))])
    best = (-np.inf, 0, 1)
    for width in range(1, round(_WIDEST * _PLACES) + 1):
        number = count[width:] - count[:-width]
        score = (total[width:] - total[:-width]) / np.sqrt(np.maximum(number, _SEEN))
        at = int(np.argmax(score))
        best = max(best, (float(score[at]), at, width))
    _, at, width = best
    return float(0.5 * (edges[at] + edges[at + width])), float(0.5 * (edges[at + width] - edges[at]))


def _of_discs(known: Known) -> tuple[float, ...]:
    """Orders of the encoders' discs at which their own whitened residual stands out, whichever's: whole numbers."""
    experiment = known.experiment
    orders = np.arange(1.0, _HIGHEST_OF_DISC)
    found: list[tuple[float, float]] = []
    for k in experiment.fit:
        series, valid = _in_time(known, k), experiment.trials[k].valid
        for channel in range(experiment.loads, len(experiment.channels)):
            angle = experiment.trials[k].measured[:, channel]
            if not np.ptp(angle[valid]) * orders[-1] > 4.0 * np.pi:
                continue
            power = _along(orders, angle[valid], series[valid][:, [channel]])
            rate = np.max(np.abs(np.diff(angle))[valid[1:] & valid[:-1]]) / experiment.dt
            fastest = 2.0 * np.pi * experiment.highest_Hz / rate
            # Less than two turns in the range is an offset and a gain; faster than the working rate shows is no line.
            power[(orders * np.ptp(angle[valid]) < 4.0 * np.pi) | (orders > fastest)] = 0.0
            peak = int(np.argmax(power))
            if power[peak] > -np.log(LINE_ALPHA / (len(orders) * len(experiment.fit))):
                found.append((float(power[peak]), float(orders[peak])))
    return _apart([value for _, value in sorted(found, reverse=True)], 0.5)


def _between_lines(known: Known, orders: tuple[float, ...]) -> dict[tuple[str, str], tuple[float, ...]]:
    """Orders of discs as what they are of: low ones of the disc's shape, high ones of its grating's interpolation.

    Without a known code it cannot be said how many of them a line of the grating is.
    """
    found: dict[tuple[str, str], tuple[float, ...]] = {}
    for joint in known.experiment.rig.joints:
        code = 0.0 if joint.encoder is None else float(joint.encoder.step)
        fine = [order for order in orders if code > 0.0 and order > _OF_ITS_SHAPE]
        found["disc bits", joint.name] = tuple(float(np.log2(2.0 * np.pi / (code * order))) for order in fine)
        found["disc order", joint.name] = tuple(order for order in orders if order not in fine)
    return found


def _along(orders: Array, angle: Array, series: Array) -> Array:
    """Power of series (n, c), scaled to unit variance, at each order of an angle (n,): the greatest of its channels.

    Orders are equally apart, and two at least. Samples are counted in cells of the angle, `_CELLS` to a turn of the
    last order: less than 1 % of its power is lost, and one Fourier transform has all orders.
    """
    x = series / np.maximum(np.std(series, axis=0), 1e-300)
    apart, count = orders[1] - orders[0], next_fast_len(_CELLS * len(orders))
    cell = np.floor(angle * (apart / (2.0 * np.pi)) % 1.0 * count).astype(np.intp) % count
    turned = np.exp(-1j * orders[0] * angle)[:, None] * x
    power = np.zeros(len(orders))
    for channel in turned.T:
        total = np.bincount(cell, channel.real, count) + 1j * np.bincount(cell, channel.imag, count)
        power = np.maximum(power, np.abs(fft(total)[: len(orders)]) ** 2)
    return power / len(angle)


def _column(columns: tuple[str, ...], values: Array, name: str) -> Array:
    return np.asarray(values[:, columns.index(name)], dtype=np.float64)


def _in_time(known: Known, k: int) -> Array:
    """(n, c) whitened residual of a trial as a series."""
    return known.metric[k].in_time(known.residual[k], len(known.experiment.trials[k].valid))


def _apart(values: list[float], least: float) -> tuple[float, ...]:
    """The first few that lie apart from those before."""
    kept: list[float] = []
    for value in values:
        if len(kept) < LINES and all(abs(value - other) > least for other in kept):
            kept.append(value)
    return tuple(kept)
