"""The equation that the gravity fit solves: prediction of the low-passed wrench, and its derivatives."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from kbs_process.errors import RecordingError
from kbs_process.plant.rigid import Links, kinematics, loads
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Array, Mask, Signal
from kbs_process.signals.smoothing import kernel_length, smooth
from kbs_process.stages.gravity.parameters import Index, RigElements, coupling_elements, rig_elements
from kbs_process.stages.motion import Motion

_RATE = 4.0  # samples kept in a period of the low-pass's corner: its stop band begins at twice the corner
_MOST = 2**14  # instants of a recording; of a longer one they are farther apart
_BLOCK = 2**12  # instants that are worked on at a time, which bounds memory
_ANGLE_STEP = 1e-5  # rad
_STEP = 1e-3  # of a sigma
RESPONSE = ("response.delay", "response.inertia")  # s, s^2

Angles = tuple[Array, Array, Array]  # q, qd, qdd, (n, joints) each


@dataclass(frozen=True, slots=True, eq=False)
class Prepared:
    """Instants of one recording: encoder readings and rates there, and one sample before and after."""

    name: str
    dt: float  # s, between `before`, the instant and `after`
    t: Array  # (n,) s from the recording's start
    q: Array  # (n, joints) rad, no offset taken off
    qd: Array
    qdd: Array
    before: Angles | None
    after: Angles | None
    sigma_q: Array
    rounding: Array  # (n, joints) rad, the encoders' part of sigma_q
    wrench: Array  # (n, c) wrench and efforts, low-passed

    @property
    def moments(self) -> list[Angles]:
        """The angles at the instants and, where known, one sample before and after."""
        return [(self.q, self.qd, self.qdd), *(angles for angles in (self.before, self.after) if angles is not None)]

    def rows(self, which: slice | Index) -> Prepared:
        """The same at some of the instants."""
        return replace(
            self,
            t=self.t[which],
            q=self.q[which],
            qd=self.qd[which],
            qdd=self.qdd[which],
            before=None if self.before is None else _pick(self.before, which),
            after=None if self.after is None else _pick(self.after, which),
            sigma_q=self.sigma_q[which],
            rounding=self.rounding[which],
            wrench=self.wrench[which],
        )

    @staticmethod
    def neighbour(motion: Motion, shift: int) -> Angles:
        """The motion one sample earlier (-1) or later (+1), its ends repeated."""
        at = np.clip(np.arange(len(motion)) + shift, 0, len(motion) - 1)
        return motion.q[at] + motion.offset, motion.qd[at], motion.qdd[at]


def _pick(angles: Angles, which: slice | Index) -> Angles:
    return angles[0][which], angles[1][which], angles[2][which]


def joined(prepared: Sequence[Prepared]) -> Prepared:
    """All instants in one, of which to predict costs less than of one recording after the other."""

    def along(angles: Sequence[Angles | None]) -> Angles | None:
        known = [one for one in angles if one is not None]
        if not known:
            return None
        q, qd, qdd = (np.concatenate(each) for each in zip(*known, strict=True))
        return q, qd, qdd

    def of(name: str) -> Array:
        return np.concatenate([getattr(p, name) for p in prepared])

    return replace(
        prepared[0],
        t=of("t"),
        q=of("q"),
        qd=of("qd"),
        qdd=of("qdd"),
        before=along([p.before for p in prepared]),
        after=along([p.after for p in prepared]),
        sigma_q=of("sigma_q"),
        rounding=of("rounding"),
        wrench=of("wrench"),
    )


def blocks(p: Prepared) -> Iterator[Prepared]:
    """The instants, some at a time."""
    for start in range(0, len(p.q), _BLOCK):
        yield p.rows(slice(start, start + _BLOCK))


def prepare(
    name: str, motion: Motion, wrench: Signal, low_pass: float, *, with_neighbours: bool, lost: str = ""
) -> Prepared:
    """Low-pass motion and wrench alike, thin them, and drop what is not valid in the wrench, or near the ends."""
    if len(motion) != len(wrench) or abs(motion.t0 - wrench.t0) > 0.01 * motion.dt:
        raise RecordingError(f"{name}: motion and wrench do not lie on one grid")
    edge = kernel_length(low_pass, motion.dt)
    stride = max(1, int(1.0 / (_RATE * low_pass * motion.dt)), -(-len(motion) // _MOST))
    good = _away_from_invalid(wrench.valid, edge)
    at = np.arange(0, len(good), stride)[good[::stride]]
    if len(at) < 8:
        whole = motion.dt * np.count_nonzero(wrench.valid)
        raise RecordingError(
            f"{name}: too short or too damaged for a gravity fit below {low_pass:g} Hz: readings and angles are whole "
            f"for {whole:.3g} s of {motion.dt * len(motion):.3g} s{lost and f', by {lost}'}",
            remedy=f"`kbs-process validate` lists gaps and readings that are no numbers: record "
            f"{4 * edge * motion.dt:.0f} s without at least, or leave this recording out of campaign.toml",
        )
    motion = replace(
        motion,
        q=smooth(motion.q, motion.dt, low_pass),
        qd=smooth(motion.qd, motion.dt, low_pass),
        qdd=smooth(motion.qdd, motion.dt, low_pass),
    )
    smoothed = Prepared(
        name=name,
        dt=motion.dt,
        t=motion.dt * np.arange(len(motion), dtype=np.float64),
        q=motion.q + motion.offset,
        qd=motion.qd,
        qdd=motion.qdd,
        before=Prepared.neighbour(motion, -1) if with_neighbours else None,
        after=Prepared.neighbour(motion, 1) if with_neighbours else None,
        sigma_q=motion.sigma_q,
        rounding=motion.sigma_rounding,
        wrench=smooth(wrench.values, wrench.dt, low_pass),
    )
    return smoothed.rows(at)


def at_rest(p: Prepared, rig: Rig) -> Prepared:
    """The instants as if the joints stood still: the rig's nominal inertial forces taken off the wrench.

    Differentiated encoder noise is in these forces. Were their parameters fitted to them, it would pull the
    estimates towards zero (errors in variables); taken off once, it is but noise.
    """
    q, rest = p.q - encoder_offsets(rig), np.zeros_like(p.q)
    inertial = loads(rig, q, p.qd, p.qdd) - loads(rig, q, rest, rest)
    index = rig.loads.index(rig.channels)
    return replace(p, qd=rest, qdd=rest, before=None, after=None, wrench=p.wrench - inertial[:, index])


def encoder_offsets(rig: Rig) -> Array:
    """(joints,) rad; zero for a joint without an encoder."""
    return np.array([0.0 if j.encoder is None else float(j.encoder.offset) for j in rig.joints])


def _away_from_invalid(valid: Mask, edge: int) -> Mask:
    """True where no invalid sample and no end lies within half a kernel's length (its tails are below 1 %)."""
    reach = max(1, edge // 2)
    bad = np.concatenate([[0], np.cumsum(~valid)])
    low = np.arange(len(valid)) - reach
    high = np.arange(len(valid)) + reach + 1
    inside = (low >= 0) & (high <= len(valid))
    clear = bad[np.clip(high, 0, len(valid))] == bad[np.clip(low, 0, len(valid))]
    away: Mask = inside & clear
    return away


@dataclass(frozen=True, slots=True, eq=False)
class Equation:
    """predicted = (I + dX) (W + delay W' + inertia W''), over the recorded channels, the bias aside.

    The response's two terms are the low-frequency expansion of what lies between the angles and the
    wrench: a delay, and a first resonance at f_n, which gives inertia = -1 / (2 pi f_n)^2. They and dX are the
    transducer's; efforts have neither.
    """

    elements: RigElements
    channels: tuple[str, ...]
    include_inertia: bool
    rows: Index  # of the free elements of dX
    columns: Index
    coupling_names: tuple[str, ...]
    response_sigma: tuple[float, float] | None

    @staticmethod
    def of(
        rig: Rig, *, include_inertia: bool, cross_coupling: bool, response_sigma: tuple[float, float] | None
    ) -> Equation:
        rows, columns, names = coupling_elements(rig)
        keep = len(rows) if cross_coupling else 0
        return Equation(
            elements=rig_elements(rig, include_inertia=include_inertia),
            channels=rig.channels,
            include_inertia=include_inertia,
            rows=rows[:keep],
            columns=columns[:keep],
            coupling_names=names[:keep],
            response_sigma=response_sigma if rig.transducer.channels else None,
        )

    @property
    def names(self) -> tuple[str, ...]:
        return self.elements.names + self.coupling_names + (RESPONSE if self.response_sigma else ())

    @property
    def size(self) -> int:
        return len(self.names)

    @property
    def index(self) -> list[int]:
        return self.elements.rig.loads.index(self.channels)

    @property
    def units(self) -> tuple[str, ...]:
        units = self.elements.rig.loads.units
        return tuple(units[index] for index in self.index)

    @property
    def bias_sigma(self) -> Array:
        """(c,) prior of a recording's taring bias; 0 of a channel whose zero is exact."""
        return self.elements.rig.loads.bias_sigma[self.index]

    def start(self) -> Array:
        return np.concatenate([self.elements.value, np.zeros(self.size - len(self.elements.names))])

    def sigma(self) -> Array:
        X = self.elements.rig.transducer.cross_coupling.sigma
        return np.concatenate([self.elements.sigma, X[self.rows, self.columns], self.response_sigma or ()])

    def lower(self) -> Array:
        rest = np.full(self.size - len(self.elements.names), -np.inf)
        return np.concatenate([self.elements.lower, rest])

    def rig_at(self, theta: Array, sigma: Array | None = None) -> Rig:
        """The rig with the free elements at theta, cross-coupling included: (I + X) = (I + X_0)(I + dX)."""
        count = len(self.elements.names)
        rig = self.elements.rig_at(theta[:count], None if sigma is None else sigma[:count])
        if len(self.rows) == 0:
            return rig
        X = rig.transducer.cross_coupling
        total = (np.eye(6) + X.value) @ (np.eye(6) + self.coupling(theta)) - np.eye(6)
        spread = X.sigma.copy()
        if sigma is not None:
            spread[self.rows, self.columns] = sigma[count : count + len(self.rows)]
        return RigElements(rig, (X,), (np.ones((6, 6), dtype=bool),)).rig_at(total.ravel(), spread.ravel())

    def bent(self, theta: Array, reached: Array) -> Array:
        """`reached` with centres of gravity where a straight step of mass times cog leads: in that loads are linear."""
        names, result = self.elements.names, reached.copy()
        for body in self.elements.rig.bodies:
            mass = names.index(body.mass.name) if body.mass.name in names else -1
            if mass >= 0 and reached[mass] > 0.5 * theta[mass] > 0.0:
                cog = [place for place, name in enumerate(names) if name.startswith(f"{body.cog.name}[")]
                result[cog] = theta[cog] + theta[mass] / reached[mass] * (reached[cog] - theta[cog])
        return result

    def predict(self, theta: Array, p: Prepared) -> Array:
        """(n, c) in the channels' units."""
        rig = self.elements.rig_at(theta[: len(self.elements.names)])
        values: Array = self._responded(theta, self._loads(rig, p, self._links(rig, p)), p.dt) @ self._mixing(theta)
        return values

    def jacobian(self, theta: Array, p: Prepared) -> Array:
        """(n c, size): rig elements by differences, the rest is linear."""
        n, c, count = len(p.q), len(self.channels), len(self.elements.names)
        J = np.zeros((n, c, self.size))
        rig = self.elements.rig_at(theta[:count])
        links = self._links(rig, p)
        moments = self._loads(rig, p, links)
        W, mixing = self._responded(theta, moments, p.dt), self._mixing(theta)
        base = W @ mixing
        for column, moved in enumerate(self.elements.moved(rig, theta, _STEP)):
            turned = moved.joints is not rig.joints or moved.transducer.tilt is not rig.transducer.tilt
            ahead = self._loads(moved, p, self._links(moved, p) if turned else links)
            slope = (self._responded(theta, ahead, p.dt) @ mixing - base) / (_STEP * self.elements.sigma[column])
            J[:, :, column] = slope
        for column, (i, j) in enumerate(zip(self.rows, self.columns, strict=True), start=count):
            J[:, self.index.index(i), column] = W[:, j]
        if self.response_sigma is not None:
            first, second = _derivatives(moments, p.dt)
            J[:, :, -2], J[:, :, -1] = first @ mixing, second @ mixing
        return J.reshape(n * c, self.size)

    def angle_slopes(self, theta: Array, p: Prepared) -> Array:
        """dW/dq (n, c, joints), N/rad and N m/rad: what an error of an angle does."""
        alone = replace(p, before=None, after=None)
        slopes = []
        for step in _ANGLE_STEP * np.eye(p.q.shape[1]):
            ahead = self.predict(theta, replace(alone, q=p.q + step))
            behind = self.predict(theta, replace(alone, q=p.q - step))
            slopes.append((ahead - behind) / (2 * _ANGLE_STEP))
        return np.stack(slopes, axis=2)

    def encoder_error(self, theta: Array, p: Prepared) -> Array:
        """|dW/dq| sigma_q (n, c), joints independent, N and N m."""
        error: Array = np.sqrt(np.sum((self.angle_slopes(theta, p) * p.sigma_q[:, None, :]) ** 2, axis=2))
        return error

    def coupling(self, theta: Array) -> Array:
        """What the calibration left of the cross-coupling, (6, 6)."""
        dX = np.zeros((6, 6))
        start = len(self.elements.names)
        dX[self.rows, self.columns] = theta[start : start + len(self.rows)]
        return dX

    def _mixing(self, theta: Array) -> Array:
        """(6 + joints, c) from all loads to the recorded channels."""
        whole = self.whole_coupling(theta)
        return (np.eye(len(whole)) + whole.T)[:, self.index]

    def whole_coupling(self, theta: Array) -> Array:
        """`coupling` among all loads, (6 + joints, 6 + joints): efforts have none."""
        count = len(self.elements.rig.loads.channels)
        dX = np.zeros((count, count))
        dX[:6, :6] = self.coupling(theta)
        return dX

    def _links(self, rig: Rig, p: Prepared) -> list[Links]:
        """The motion of the links at the instants and, where known, one sample before and after."""
        return [kinematics(rig, q - encoder_offsets(rig), qd, qdd) for q, qd, qdd in p.moments]

    def _loads(self, rig: Rig, p: Prepared, links: list[Links]) -> tuple[Array, ...]:
        """All loads then."""
        return tuple(loads(rig, *moment, links=one) for moment, one in zip(p.moments, links, strict=True))

    def _responded(self, theta: Array, moments: tuple[Array, ...], dt: float) -> Array:
        if self.response_sigma is None or len(moments) == 1:
            return moments[0]
        first, second = _derivatives(moments, dt)
        delay, inertia = theta[-2:]
        total: Array = moments[0] + delay * first + inertia * second
        return total


def _derivatives(moments: tuple[Array, ...], dt: float) -> tuple[Array, Array]:
    """First and second central difference of the wrench, exact to (2 pi f dt)^2 / 6 and / 12; zero of the efforts."""
    now, before, after = moments
    first, second = (after - before) / (2 * dt), (after - 2 * now + before) / dt**2
    first[:, 6:] = second[:, 6:] = 0.0
    return first, second
