"""What would make a fit agree with what was known: simple faults of readings or description, each tried on the data.

A fault is undone in the readings (a gain, swapped channels, turned axes, an angle's sense, unit or zero), or some
numbers of the description are set free. Then the equation is solved anew, with few instants and made linear. A fault
is named if all other numbers are then within what their priors allow, and it describes the data as well as any other.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from kbs_process.estimation.longrun import variance_inflation
from kbs_process.signals.records import WRENCH_CHANNELS, Array
from kbs_process.stages.gravity.equation import Angles, Equation, Prepared, joined
from kbs_process.stages.gravity.parameters import CROSS_COUPLING, Index
from kbs_process.stages.gravity.solve import ZERO, least_sigma, zero_priors, zero_slopes
from kbs_process.stages.gravity.tension import BEYOND, BY_CHANCE, by_chance, exchanges, reversals, together

Kind = Literal["gain", "silent", "swapped", "axes", "sense", "unit", "clock", "zero", "point", "bias", "number"]

_POINTS = 60  # instants of a recording
_RECORDINGS = 3
_AGAIN = 12  # of the faults nearest to the data, solved again
_ROUNDS = 4  # of weights
_STEPS = 3  # of the equation, made linear anew about what was found
_FREE = 1e3  # times its sigma, a number that is set free may move
_AS_GOOD = 20.0  # twice the logarithm of a likelihood ratio
RATHER = 100.0  # of the same, by which data have to prefer what nothing else makes doubtful
_MOST = 4  # faults named
_ANGLES = {  # rad, of what was taken for a radian
    "degrees": np.pi / 180.0,
    "milliradian": 1e-3,
    "turns": 2.0 * np.pi,
    "radian, converted as if they were degrees": 180.0 / np.pi,
}
_LEAST = 1e-6  # factor of accelerations
_QUARTERS = (0.0, 0.5 * np.pi, np.pi, -0.5 * np.pi)  # where an angle's zero is looked for


@dataclass(frozen=True, slots=True, eq=False)
class Fault:
    """Something simple that may be wrong: how to undo it, and what it leaves open."""

    kind: Kind
    what: str  # channels, joint or quantity
    wrench: Array | None = None  # (c, c) from what is read to what acts
    angles: Array | None = None  # (joints, joints) from what is read to what is
    gained: tuple[str, ...] = ()  # channels that have one unknown gain
    joint: int | None = None  # whose angle has another zero
    near: float = 0.0  # rad, where that is looked for
    free: tuple[int, ...] = ()  # numbers that are not held to their priors


@dataclass(frozen=True, slots=True, eq=False)
class Explained:
    """A fault, and what the data make of it."""

    fault: Fault
    cost: float  # -2 ln of the posterior
    sound: bool  # all else is within its prior, and little is left
    found: Array  # the gain, accelerations' factor, the zero (rad), the point of reference (m), or numbers set free
    stated: Array  # what is said of the latter
    sigma: float = 0.0  # of a gain's logarithm


def explanations(equation: Equation, prepared: Sequence[Prepared], most: Array) -> tuple[Explained, ...]:
    """Return the faults that explain the data, simple ones first; `most` (c,) is the rms that may be left."""
    data = _linear(equation, [p.rows(_spread(len(p.q))) for p in prepared[:_RECORDINGS]])
    tried = [_solve(data, fault, most, anew=False) for fault in _faults(data)]
    nearest = min((one.cost for one in tried if one.sound), default=np.inf)
    near = sorted((one for one in tried if one.sound or one.cost < nearest), key=lambda one: one.cost)[:_AGAIN]
    again = [_solve(data, one.fault, most, anew=True) for one in tried if one in near]
    best = min((one.cost for one in again if one.sound), default=0.0) + _AS_GOOD
    return tuple(one for one in again if one.sound and one.cost < best)[:_MOST]


def shown_gains(equation: Equation, prepared: Sequence[Prepared]) -> dict[str, tuple[float, float, float]]:
    """Each channel's gain, its relative standard deviation, and twice the logarithm of how much likelier it is than 1.

    Nothing is known of it but what gravity shows.
    """
    data = _linear(equation, [p.rows(_spread(len(p.q))) for p in prepared[:_RECORDINGS]])
    most = np.full(len(equation.channels), np.inf)
    stated = _solve(data, Fault("number", ""), most, anew=False).cost
    single = [Fault("gain", key, gained=(key,)) for key in equation.channels if key in WRENCH_CHANNELS]
    solved = [_solve(data, one, most, anew=False) for one in single]
    return {one.what: (float(x.found[0]), x.sigma, stated - x.cost) for one, x in zip(single, solved, strict=True)}


def turned(equation: Equation, prepared: Sequence[Prepared]) -> Iterator[tuple[str, float]]:
    """Joints that the data would rather have turn the other way, and twice the logarithm of how much rather."""
    data = _linear(equation, [p.rows(_spread(len(p.q))) for p in prepared[:_RECORDINGS]])
    most = np.full(len(equation.channels), np.inf)
    none = Fault("number", "")
    for joint, matrix in reversals(equation.elements.rig.joints):
        both = none, Fault("sense", joint, angles=matrix)
        for anew in (False, True):  # the second takes its time
            stated, other = (_solve(data, one, most, anew=anew) for one in both)
            if not other.sound or stated.cost - other.cost < RATHER:
                break
        else:
            yield joint, stated.cost - other.cost


def _spread(count: int) -> Index:
    return np.unique(np.linspace(0, count - 1, min(count, _POINTS)).astype(np.intp))


def _faults(data: _Data) -> Iterator[Fault]:
    channels, joints = data.equation.channels, data.equation.elements.rig.joints
    yield from _gains(channels)
    yield from _mixed(channels)
    unit = np.eye(len(joints))
    yield from (Fault("sense", joint, angles=matrix) for joint, matrix in reversals(joints))
    yield from (Fault("swapped", f"the angles of {pair}", angles=matrix) for pair, matrix in exchanges(joints))
    turning = [index for index, joint in enumerate(joints) if joint.type == "revolute"]
    for (name, factor), some in itertools.product(_ANGLES.items(), _any(turning)):
        scaled = unit.copy()
        scaled[some, some] = factor
        yield Fault("unit", f"angles of {', '.join(joints[index].name for index in some)} are {name}", angles=scaled)
    yield Fault("clock", "")
    for index, near in itertools.product(turning, _QUARTERS):
        yield Fault("zero", joints[index].name, joint=index, near=near)
    if channels[:6] == WRENCH_CHANNELS:
        yield Fault("point", "")
    yield from _numbers(data)


def _any(members: list[int]) -> list[list[int]]:
    """All together, and each alone."""
    return [members] if len(members) < 2 else [members, *([one] for one in members)]


def _gains(channels: Sequence[str]) -> Iterator[Fault]:
    """One gain of all channels, of the forces, of the torques, of one channel."""
    wrench = tuple(channel for channel in channels if channel in WRENCH_CHANNELS)
    forces, torques = (tuple(channel for channel in wrench if channel[0] == letter) for letter in "FT")
    groups = {"all channels of the wrench": wrench, "all forces": forces, "all torques": torques}
    several = {members: name for name, members in groups.items() if len(members) > 1}
    for members, name in several.items():
        yield Fault("gain", name, gained=members)
    for channel in channels:
        yield Fault("gain", channel, gained=(channel,))
        yield Fault("silent", channel)


def _mixed(channels: Sequence[str]) -> Iterator[Fault]:
    """Channels swapped, and axes of the transducer that are not those of the description."""
    unit = np.eye(len(channels))
    wrench = [index for index, channel in enumerate(channels) if channel in WRENCH_CHANNELS]
    for a, b in itertools.combinations(wrench, 2):
        yield Fault("swapped", f"{channels[a]} and {channels[b]}", wrench=_exchange(unit, a, b))
    if tuple(channels[:6]) != WRENCH_CHANNELS:
        return
    for a, b in itertools.combinations(range(3), 2):
        both = _exchange(unit, a, b) @ _exchange(unit, a + 3, b + 3)
        yield Fault("swapped", f"{'xyz'[a]} and {'xyz'[b]}, of forces and torques", wrench=both)
    yield Fault("swapped", "forces and torques", wrench=unit[np.r_[3:6, 0:3, 6 : len(channels)]])
    for order, signs in itertools.product(itertools.permutations(range(3)), itertools.product((1.0, -1.0), repeat=3)):
        turn = np.eye(3)[list(order)] * np.array(signs)[:, None]
        if np.linalg.det(turn) < 0.0 or np.array_equal(turn, np.eye(3)):
            continue
        whole = unit.copy()
        whole[:3, :3] = whole[3:6, 3:6] = turn
        read = (f"{'-' if sign < 0.0 else '+'}{'xyz'[column]}" for sign, column in zip(signs, order, strict=True))
        yield Fault("axes", ", ".join(read), wrench=whole)


def _exchange(unit: Array, a: int, b: int) -> Array:
    order = np.arange(len(unit))
    order[[a, b]] = b, a
    exchanged: Array = unit[order]
    return exchanged


def _numbers(data: _Data) -> Iterator[Fault]:
    """One quantity of the description, or the zero of one channel or recording, is not what is stated."""
    groups: dict[tuple[Kind, str], list[int]] = {}
    for index, name in enumerate(data.names):
        term, _, rest = name.partition("[")
        if term == ZERO[0]:
            recording, _, channel = rest.partition("].")
            groups.setdefault(("bias", channel), []).append(index)
            groups.setdefault(("bias", recording), []).append(index)
        elif term not in (*ZERO, CROSS_COUPLING):  # a matrix that is free can be anything at all
            groups.setdefault(("number", term), []).append(index)
    for (kind, name), members in groups.items():
        yield Fault(kind, name, free=tuple(members))


@dataclass(frozen=True, slots=True, eq=False)
class _Data:
    """The equation at a few instants, linear about some numbers: y = base + J (numbers - about)."""

    equation: Equation
    names: tuple[str, ...]
    prior: Array  # (k,)
    sigma: Array  # (k,)
    about: Array  # (k,)
    prepared: tuple[Prepared, ...]
    base: tuple[Array, ...]  # (n, c)
    J: tuple[Array, ...]  # (n, c, k)


def _linear(equation: Equation, prepared: Sequence[Prepared], about: Array | None = None) -> _Data:
    c, size = len(equation.channels), equation.size
    zeros, zeros_sigma = zero_priors(equation, prepared)
    width = len(zeros) // len(prepared)
    prior = np.concatenate([equation.start(), np.zeros(len(zeros))])
    about = prior if about is None else about
    base, slopes = [], []
    every = joined(prepared)
    static = equation.predict(about[:size], every)
    whole = equation.jacobian(about[:size], every).reshape(*static.shape, size)
    ends = np.cumsum([0, *(len(p.q) for p in prepared)])
    for index, p in enumerate(prepared):
        rows = slice(ends[index], ends[index + 1])
        J = np.zeros((len(p.q), c, len(prior)))
        J[:, :, :size] = whole[rows]
        own = slice(size + index * width, size + (index + 1) * width)
        J[:, :, own] = zero_slopes(equation, p)
        base.append(static[rows] + J[:, :, own] @ about[own])
        slopes.append(J)
    sigma = np.concatenate([equation.sigma(), zeros_sigma])
    return _Data(equation, equation.names + zeros, prior, sigma, about, tuple(prepared), tuple(base), tuple(slopes))


def _solve(data: _Data, fault: Fault, most: Array, *, anew: bool) -> Explained:
    """Undo a fault and solve, `anew` about what was found; a gain or a zero is found in steps of its own."""
    at = [data.equation.channels.index(channel) for channel in fault.gained]
    open_: Array = np.zeros(0)
    if fault.gained:
        open_ = np.array([_first_gain(data, at)])
    elif fault.joint is not None:
        open_ = np.array([fault.near])
    elif fault.kind == "clock":
        open_ = np.ones(1)
    elif fault.kind == "point":
        open_ = np.zeros(3)
    about = data.about
    for step in range(_STEPS if anew or fault.gained or fault.joint is not None else 1):
        turned = fault.angles is not None or fault.joint is not None or fault.kind == "clock"
        if turned or (anew and step):
            angled = [_turned(p, fault, open_) for p in data.prepared] if turned else data.prepared
            local = _linear(data.equation, angled, about)
        else:
            local = data
        local = _silent(local, fault.what) if fault.kind == "silent" else local
        wrench = [_undone(data, fault, p.wrench, at, open_) for p in data.prepared]
        slopes = [_slopes(local, fault, p, base, at, open_) for p, base in zip(local.prepared, local.base, strict=True)]
        numbers, more, solved = _refit(local, fault, wrench, slopes, most)
        about = numbers if anew else about
        if fault.gained:
            open_ = open_ * np.exp(np.clip(more, -1.0, 1.0))
        else:
            open_ = more if fault.kind == "point" else open_ + more
            open_ = np.maximum(open_, _LEAST) if fault.kind == "clock" else open_
    if fault.gained:
        count = 2.0 * len(at) * sum(len(p.q) for p in data.prepared)
        solved = replace(solved, cost=solved.cost + count * float(np.log(abs(open_[0]))))
    free = list(fault.free)
    lower = np.concatenate([data.equation.lower(), np.full(len(data.names) - data.equation.size, -np.inf)])
    return replace(
        solved,
        found=numbers[free] if free else open_,
        stated=data.prior[free],
        sound=solved.sound
        and bool(np.all(numbers[free] >= lower[free]))
        and not (fault.kind == "clock" and open_[0] <= _LEAST),
    )


def _silent(data: _Data, channel: str) -> _Data:
    """The same where a channel reads its zero alone."""
    size = data.equation.size
    heard = np.array([key != channel for key in data.equation.channels], dtype=np.float64)
    keep = _decoupled(data, _raw(data, np.eye(len(heard))) * heard)
    zeros = [own[:, :, size:] @ data.about[size:] for own in data.J]
    base = tuple((x - zero) @ keep + zero for x, zero in zip(data.base, zeros, strict=True))
    J = (np.concatenate([np.einsum("cd,nck->ndk", keep, own[:, :, :size]), own[:, :, size:]], axis=2) for own in data.J)
    return replace(data, base=base, J=tuple(J))


def _first_gain(data: _Data, at: list[int]) -> float:
    """Slope, through zero, of what is read on some channels against what is computed."""
    y = np.concatenate([_raw(data, p.wrench)[:, at].ravel() for p in data.prepared])
    x = np.concatenate([_raw(data, base)[:, at].ravel() for base in data.base])
    gain = float(x @ y / max(float(x @ x), 1e-300))
    return gain if np.isfinite(gain) and abs(gain) > 1e-9 else 1.0


def _undone(data: _Data, fault: Fault, wrench: Array, at: list[int], open_: Array) -> Array:
    if fault.gained:
        factor = np.ones(wrench.shape[1])
        factor[at] = 1.0 / open_[0]
        return _decoupled(data, _raw(data, wrench) * factor)
    return wrench if fault.wrench is None else _decoupled(data, _raw(data, wrench) @ fault.wrench.T)


def _slopes(data: _Data, fault: Fault, p: Prepared, base: Array, at: list[int], open_: Array) -> Array:
    """(n, c, m) what a step changes: of the gain's logarithm, accelerations' factor, the angle's zero, or the point."""
    if fault.gained:
        part = np.zeros(base.shape[1])
        part[at] = 1.0
        return _decoupled(data, _raw(data, base) * part)[:, :, None]
    if fault.joint is not None:
        return -data.equation.angle_slopes(data.about[: data.equation.size], p)[:, :, [fault.joint]]
    if fault.kind == "clock":
        theta, still = data.about[: data.equation.size], _turned(p, fault, np.zeros(1))
        by_motion: Array = (data.equation.predict(theta, p) - data.equation.predict(theta, still))[:, :, None] / open_
        return by_motion
    if fault.kind == "point":
        slopes = np.zeros((*base.shape, 3))
        for axis, unit in enumerate(np.eye(3)):
            slopes[:, 3:6, axis] = -np.cross(unit, base[:, :3])
        return slopes
    return np.zeros((*base.shape, 0))


def _turned(p: Prepared, fault: Fault, open_: Array) -> Prepared:
    matrix = np.eye(p.q.shape[1]) if fault.angles is None else fault.angles
    zero = np.zeros(len(matrix))
    if fault.joint is not None:
        zero[fault.joint] = open_[0]
    faster = float(open_[0]) if fault.kind == "clock" else 1.0

    def along(angles: Angles) -> Angles:
        q, qd, qdd = (each @ matrix.T for each in angles)
        return q - zero, qd * np.sqrt(faster), qdd * faster

    q, qd, qdd = along((p.q, p.qd, p.qdd))
    before, after = (None if angles is None else along(angles) for angles in (p.before, p.after))
    return replace(p, q=q, qd=qd, qdd=qdd, before=before, after=after)


def _refit(
    data: _Data, fault: Fault, wrench: Sequence[Array], slopes: Sequence[Array], most: Array
) -> tuple[Array, Array, Explained]:
    """Solve for all numbers and what a fault leaves open, each channel weighed by what is left of it."""
    rig, k, m = data.equation.elements.rig, len(data.sigma), slopes[0].shape[2]
    sigma = data.sigma.copy()
    sigma[list(fault.free)] *= _FREE
    scale = np.concatenate([sigma, np.ones(m)])
    left = [y - base for y, base in zip(wrench, data.base, strict=True)]
    J = [np.concatenate([own, more], axis=2) * scale for own, more in zip(data.J, slopes, strict=True)]
    held = np.concatenate([np.ones(k), np.full(m, 1e-6)])
    aim = held * np.concatenate([(data.prior - data.about) / sigma, np.zeros(m)])
    floors = [least_sigma(p, rig) for p in data.prepared]
    sigmas = [np.maximum(0.01 * np.ptp(y, axis=0), 10.0 * low) for y, low in zip(wrench, floors, strict=True)]
    for _ in range(_ROUNDS):
        rows = np.concatenate([(j / s[:, None]).reshape(-1, k + m) for j, s in zip(J, sigmas, strict=True)])
        y = np.concatenate([(x / s).ravel() for x, s in zip(left, sigmas, strict=True)])
        H = rows.T @ rows + np.diag(held)
        step = np.linalg.solve(H, rows.T @ y + aim)
        after = [x - j @ step for x, j in zip(left, J, strict=True)]
        weighed = sigmas
        sigmas = [
            np.maximum(np.sqrt(np.mean(r**2, axis=0) * variance_inflation(r)), low)
            for r, low in zip(after, floors, strict=True)
        ]
    numbers = data.about + step[:k] * sigma
    inverse = np.linalg.inv(H)
    told = np.setdiff1d(np.arange(k), fault.free)
    C = (np.eye(k + m) - inverse)[np.ix_(told, told)]
    moved = ((numbers - data.prior) / sigma)[told]
    single = by_chance([data.names[i] for i in told], np.zeros(len(told)), moved, np.ones(len(told)), C)
    rms = np.sqrt(np.mean(np.concatenate(after) ** 2, axis=0))
    cost = sum(
        float(np.sum((r / s) ** 2) + 2.0 * len(r) * np.sum(np.log(s))) for r, s in zip(after, weighed, strict=True)
    )
    sound = (
        bool(np.all(rms <= most))
        and all(abs(one.distance) < BEYOND for one in single)
        and together(moved, C) >= BY_CHANCE
    )
    own = float(np.sqrt(inverse[k, k])) if m else 0.0
    return numbers, step[k:], Explained(fault, cost + float(moved @ moved), sound, np.zeros(0), np.zeros(0), own)


def _mixing(data: _Data) -> Array:
    """I + X of the certificate among the recorded channels, (c, c)."""
    channels = data.equation.channels
    at = [WRENCH_CHANNELS.index(channel) for channel in channels if channel in WRENCH_CHANNELS]
    whole = np.eye(len(channels))
    whole[: len(at), : len(at)] += data.equation.elements.rig.transducer.cross_coupling.value[np.ix_(at, at)]
    return whole


def _raw(data: _Data, wrench: Array) -> Array:
    """Decoupled loads as the transducer reads them, its nominal zero left out."""
    raw: Array = wrench @ _mixing(data).T
    return raw


def _decoupled(data: _Data, raw: Array) -> Array:
    decoupled: Array = raw @ np.linalg.inv(_mixing(data)).T
    return decoupled
