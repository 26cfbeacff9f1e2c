r"""From inputs at any inlet to the channels: the plant linearised along the trajectory that it is on.

    M(t) x'' + C(t) x' + K(t) x = P(t) u,   wrench = G x - L x'' + D u,   angles = x of the outputs

with the matrices of the pose and of the drives' equations at their operating points, averaged over the tooth passings
around each knot and interpolated between knots. A step is exact for a constant plant and an input equal to its mean
over the step: no resonance is shifted and no stiffness of a rotor bounds the step. All inputs of a batch go through
the plant side by side. What passes below the working rate's Nyquist frequency is then taken at the working rate:
the three averages over a step (of input, hold, output) are undone there, and the amplifier is applied to the wrench.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft, rfftfreq
from scipy.linalg import expm

from kbs_process.diagnosis.screening.inlets import Inlet, generalised, inlets_of
from kbs_process.machine_code import njit
from kbs_process.plant.effect import CROSSED, SIGNALS, Effect, Port
from kbs_process.plant.linear.linearise import Linear, drive_damping, drive_stiffness, linearise
from kbs_process.plant.structure import other_joint
from kbs_process.rig.model import Amplifier, Joint, Rig
from kbs_process.signals.records import WRENCH_CHANNELS, Array

KNOT_S = 1.0  # s between knots: 2 deg at the fastest rate of the paper's mechanism
POSE = np.deg2rad(0.25)  # poses nearer than that share their matrices of mass
PHASES = 4  # operating points around a knot over which the drives' slopes are averaged
_MIDDLES = (np.arange(PHASES) + 0.5) / PHASES - 0.5  # of knots' intervals
_RATES = ("joint_rate", "rotor_rate")
_STANDS = 1e-5  # rad of the motor in a step, below which it stands: a thousandth of a tooth's contact
BATCH = 32  # columns that pass through the plant together: their states stay in the nearest cache
_PAD_S = 2.0  # s at either end, over which one end blends into the other

Index = NDArray[np.intp]
Drives = Sequence[Mapping[Inlet, Array]]  # of each column: what enters where, (n,) means over the steps


@dataclass(frozen=True, slots=True, eq=False)
class Path:
    """The linear plant along a trajectory; c coordinates, k knots."""

    rig: Rig
    joints: tuple[str, ...]
    rate: float  # Hz, of the steps
    knots: Array  # (k,) steps
    systems: tuple[Linear, ...]  # (k,) with the drives' slopes of the operating points
    step: Array  # (k, 2 c, 2 c) of the state [x, x' h]
    push: Array  # (k, 2 c, c) by generalised forces
    wrench: Array  # (k, 6, c) of unit angles: weight's and other loads' in the plate's axes
    drag: Array  # (k, 6, c) of unit rates
    lever: Array  # (k, 6, c) momentum of unit rates
    inlets: tuple[Inlet, ...]  # m of them: all that the rig has
    force: Array  # (k, c, m) generalised forces of unit inputs, and
    direct: Array  # (k, 6, m) what these add to the wrench themselves
    ripple: Array  # (n, joints) N m/rad of the output: slope of the rotor's torque as teeth pass, mean over each step


def follow(rig: Rig, effects: Sequence[Effect], taps: Mapping[str, Array], rate: float) -> Path:
    """Linearise along `taps` (n,) of each SIGNAL.JOINT (`plant.compiled.taps.tap_columns`), sampled at `rate` Hz.

    Validity: small inputs. A rotor that sticks moves here; a controller that reads the encoders does not react, which
    is how a plant behaves that is driven by its recorded field.
    """
    driven = tuple(joint for joint in rig.joints if joint.drive is not None)
    n = len(taps[f"joint_angle.{rig.joints[0].name}"])
    every = max(1, round(KNOT_S * rate))
    half = every // (2 * PHASES)
    knots = np.unique(np.append(np.arange(0, n, every), n - 1))
    angles = np.stack([taps[f"joint_angle.{joint.name}"] for joint in rig.joints], axis=1)
    laboratory = [effect for effect in effects if not effect.port.internal]
    steady = [effect for effect in effects if not _passes(effect)]
    known: dict[tuple[int, ...], Linear] = {}
    systems = []
    for knot in knots:
        rounded = np.rint(angles[knot] / POSE)
        key = tuple(int(value) for value in rounded)
        if key not in known:
            known[key] = linearise(rig, laboratory, rounded * POSE)
        bare = known[key]
        C, K = bare.C.copy(), bare.K.copy()
        around = np.unique(np.clip(knot + _MIDDLES * every, 0, n - 1).astype(int))
        for index, joint in enumerate(driven):
            assert joint.drive is not None
            out = bare.plate + index
            pair = np.ix_([out, out + len(driven)], [out, out + len(driven)])
            signals = _signals(taps, joint.name, other_joint(rig, joint.name))
            moves = np.ptp(signals["rotor_angle"][around]) > _STANDS
            points = around if moves else around[:1]
            damping = np.zeros((2, 2))
            for sample in points:
                at = dict.fromkeys(SIGNALS, 0.0) | {name: float(values[sample]) for name, values in signals.items()}
                near = slice(max(0, sample - half), sample + half + 1)
                reach = {name: 0.5 * float(np.ptp(signals[name][near])) for name in _RATES}
                K[pair] += drive_stiffness(joint.drive, steady, at) / len(points)
                damping += drive_damping(joint.drive, effects, at, reach) / len(points)
            # Friction that falls with the rate makes a motor run away from an operating point at which it stands or
            # cycles in truth: of its damping no less than none is left.
            damping[1, 1] -= min(0.0, float(damping[1].sum()))
            C[pair] += damping
        systems.append(replace(bare, C=C, K=K))
    step, push = _discretised(systems, 1.0 / rate)
    inlets = inlets_of(rig)
    entered = [generalised(rig, system, inlets, pose) for system, pose in zip(systems, angles[knots], strict=True)]
    return Path(
        rig,
        tuple(joint.name for joint in driven),
        rate,
        knots.astype(float),
        tuple(systems),
        step,
        push,
        np.stack([system.gravity for system in systems]),
        np.stack([system.drag for system in systems]),
        np.stack([system.momentum for system in systems]),
        inlets,
        np.stack([force for force, _ in entered]),
        np.stack([direct for _, direct in entered]),
        np.stack([_ripple(joint, effects, _signals(taps, joint.name, joint.name), rate) for joint in driven], axis=1),
    )


def _signals(taps: Mapping[str, Array], joint: str, other: str) -> dict[str, Array]:
    own = {name.partition(".")[0]: values for name, values in taps.items() if name.endswith(f".{joint}")}
    return own | {name: taps[f"{name.replace('other', 'joint')}.{other}"] for name in CROSSED}


def _passes(effect: Effect) -> bool:
    """Whether it acts on the rotor by its position alone: its slope comes and goes as teeth or turns pass."""
    position = "rotor_angle" in effect.arguments and not {"field", "joint_angle"} & set(effect.arguments)
    return position and not effect.states and effect.port.of_rotor


def _ripple(joint: Joint, effects: Sequence[Effect], signals: Mapping[str, Array], rate: float) -> Array:
    """Minus d torque / d angle of what passes with the rotor's turns, mean over each step: (n,), N m/rad at the output.

    A mean over the step is the secant between its ends, exact for torques that jump as well. It is weak beside the
    motor's own stiffness, but what it makes of a constant input is a tone, which resonances amplify.
    """
    assert joint.drive is not None
    known = {"ratio": float(joint.drive.ratio)} | {k: float(q) for k, q in joint.drive.parameters.items()}
    angle = signals["rotor_angle"]
    ahead = np.append(angle[1:], angle[-1])
    apart = ahead - angle
    still = np.abs(apart) < _STANDS
    ahead = np.where(still, angle + _STANDS, ahead)
    mean_rate = apart * rate
    slope = np.zeros(len(angle))
    moves = still & np.append(True, ~still[:-1]) | ~still  # at rest one step stands for all
    for effect in effects:
        if not _passes(effect):
            continue
        friction = effect.port is Port.MOTOR_FRICTION
        part, wired = np.zeros(len(angle)), effect.arguments
        for k in np.flatnonzero(moves):
            at = known | {"rotor_rate": float(mean_rate[k]), "rotor_travel": 0.0, "time": k / rate}
            sign = -np.sign(mean_rate[k]) * (not still[k]) if friction else 1.0
            ends = [
                effect.equation(*[end if name == "rotor_angle" else at[name] for name in wired])
                for end in (float(angle[k]), float(ahead[k]))
            ]
            part[k] = sign * (ends[1] - ends[0]) / (ahead[k] - angle[k])
        slope += part[np.maximum.accumulate(np.where(moves, np.arange(len(angle)), 0))]
    return -slope * known["ratio"] ** 2


def _discretised(systems: Sequence[Linear], h: float) -> tuple[Array, Array]:
    """Exact step of [x, x' h] over h and its push by forces that are constant over it, (k, 2c, 2c) and (k, 2c, c)."""
    c = len(systems[0].M)
    whole = np.zeros((len(systems), 3 * c, 3 * c))
    for index, system in enumerate(systems):
        inverse = np.linalg.inv(system.M)
        whole[index, :c, c : 2 * c] = np.eye(c)
        whole[index, c : 2 * c, :c] = -inverse @ system.K * h**2
        whole[index, c : 2 * c, c : 2 * c] = -inverse @ system.C * h
        whole[index, c : 2 * c, 2 * c :] = inverse * h**2
    exact = expm(whole)
    return np.ascontiguousarray(exact[:, : 2 * c, : 2 * c]), np.ascontiguousarray(exact[:, : 2 * c, 2 * c :])


def respond(path: Path, drives: Drives, channels: Sequence[str], decimation: int, samples: int) -> Array:
    """What inputs add to the channels at the working rate, (samples, channels + joints, columns).

    `drives` has for each column what enters where. The path's rate is `decimation` times the working rate; sample 0 is
    at the beginning of step 0. The plant begins in equilibrium with the first inputs.
    """
    rows = [WRENCH_CHANNELS.index(name) for name in channels]
    outs = [path.systems[0].output(name) for name in path.joints]
    result = np.empty((samples, len(rows) + len(outs), len(drives)))
    place = {inlet: k for k, inlet in enumerate(path.inlets)}
    post = _post(path, decimation, samples)
    for first in range(0, len(drives), BATCH):
        batch = drives[first : first + BATCH]
        entries = [(column, inlet) for column, drive in enumerate(batch) for inlet in drive]
        series = np.stack([np.asarray(batch[column][inlet], dtype=float) for column, inlet in entries])
        column_of = np.array([column for column, _ in entries])
        inlet_of = np.array([place[inlet] for _, inlet in entries])
        start = _equilibrium(path, path.force[0][:, inlet_of] * series[:, 0], column_of, len(batch))
        fine = _along(
            path.knots,
            path.step,
            path.push,
            path.wrench[:, rows],
            path.drag[:, rows] * path.rate,
            path.lever[:, rows] * path.rate**2,
            np.array(outs, dtype=np.intp),
            path.force,
            path.direct[:, rows],
            series,
            column_of,
            inlet_of,
            path.ripple,
            start,
        )
        result[:, :, first : first + BATCH] = post(fine, len(rows))
    return result


def _equilibrium(path: Path, forces: Array, column_of: Index, columns: int) -> Array:
    """State (2 c, columns) at rest under the first forces (c, entries)."""
    c = len(forces)
    total = np.zeros((c, columns))
    np.add.at(total.T, column_of, forces.T)
    state = np.zeros((2 * c, columns))
    state[:c] = np.linalg.solve(path.systems[0].K, total)
    return state


@njit(cache=True, nogil=True, error_model="numpy", fastmath=True)
def _along(
    knots: Array,
    step: Array,
    push: Array,
    weight: Array,
    drag: Array,
    lever: Array,
    outs: Index,
    force: Array,
    direct: Array,
    series: Array,
    column_of: Index,
    inlet_of: Index,
    ripple: Array,
    start: Array,
) -> Array:
    """Means over each step of wrench and output angles, (channels + joints, columns, n)."""
    size, columns = start.shape
    c = size // 2
    rows, joints = weight.shape[1], outs.shape[0]
    n = series.shape[1]
    out = np.empty((rows + joints, columns, n))
    x = start.copy()
    new, load, mean, change = (np.empty_like(x), np.empty((c, columns)), np.empty((c, columns)), np.empty((c, columns)))
    value = np.empty(columns)
    A, B = np.empty((size, size)), np.empty((size, c))
    W, V, L = np.empty((rows, c)), np.empty((rows, c)), np.empty((rows, c))
    F, D = np.empty((c, force.shape[2])), np.empty((rows, force.shape[2]))
    knot = 0
    for k in range(n):
        while knot < knots.shape[0] - 2 and knots[knot + 1] <= k:
            knot += 1
        t = min(1.0, (k - knots[knot]) / (knots[knot + 1] - knots[knot]))
        s = 1.0 - t
        A[:, :] = s * step[knot] + t * step[knot + 1]
        B[:, :] = s * push[knot] + t * push[knot + 1]
        W[:, :] = s * weight[knot] + t * weight[knot + 1]
        V[:, :] = s * drag[knot] + t * drag[knot + 1]
        L[:, :] = s * lever[knot] + t * lever[knot + 1]
        F[:, :] = s * force[knot] + t * force[knot + 1]
        D[:, :] = s * direct[knot] + t * direct[knot + 1]
        load[:, :] = 0.0
        for entry in range(series.shape[0]):
            u = series[entry, k]
            for i in range(c):
                load[i, column_of[entry]] += F[i, inlet_of[entry]] * u
        for j in range(joints):
            # Weak beside the motor's stiffness, so the middle of the step may be taken from its beginning.
            for m in range(columns):
                rotor = c - joints + j
                load[rotor, m] -= ripple[k, j] * x[rotor, m]
        for i in range(size):
            row = new[i]
            row[:] = 0.0
            for j in range(size):
                a = A[i, j]
                for m in range(columns):
                    row[m] += a * x[j, m]
            for j in range(c):
                b = B[i, j]
                for m in range(columns):
                    row[m] += b * load[j, m]
        for i in range(c):
            for m in range(columns):
                # Hermite's rule: the mean of x from both ends and their rates, right to h^4.
                change[i, m] = new[c + i, m] - x[c + i, m]
                mean[i, m] = 0.5 * (x[i, m] + new[i, m]) - change[i, m] / 12.0
        for r in range(rows):
            value[:] = 0.0
            for i in range(c):
                w, v, p = W[r, i], V[r, i], L[r, i]
                for m in range(columns):
                    value[m] += w * mean[i, m] - p * change[i, m]
                if v != 0.0:
                    for m in range(columns):
                        value[m] += v * (new[i, m] - x[i, m])
            for entry in range(series.shape[0]):
                value[column_of[entry]] += D[r, inlet_of[entry]] * series[entry, k]
            for m in range(columns):
                out[r, m, k] = value[m]
        for r in range(joints):
            for m in range(columns):
                out[rows + r, m, k] = mean[outs[r], m]
        x, new = new, x
    return out


@dataclass(frozen=True, slots=True, eq=False)
class _Post:
    """To the working rate, in the frequency domain: amplifier, averages undone, what lies beyond Nyquist cut."""

    length: int
    decimation: int
    samples: int
    wrench: Array  # (f,) complex
    angle: Array  # (f,)

    def __call__(self, fine: Array, rows: int) -> Array:
        """(samples, channels, columns) of (channels, columns, n)."""
        n = fine.shape[2]
        blend = 0.5 - 0.5 * np.cos(np.pi * (np.arange(self.length - n) + 0.5) / (self.length - n))
        padded = np.empty((*fine.shape[:2], self.length))
        padded[..., :n] = fine
        padded[..., n:] = fine[..., -1:] + (fine[..., :1] - fine[..., -1:]) * blend
        bins = len(self.wrench)
        spectrum = rfft(padded, axis=2)[..., :bins]
        spectrum[:rows] *= self.wrench
        spectrum[rows:] *= self.angle
        coarse = irfft(spectrum, n=self.length // self.decimation, axis=2) / self.decimation
        return np.ascontiguousarray(np.moveaxis(coarse[..., : self.samples], 2, 0))


def _post(path: Path, decimation: int, samples: int) -> _Post:
    n = samples * decimation
    pad = round(_PAD_S * path.rate / decimation)
    length = next_fast_len(samples + pad, real=True)
    if length % 2:
        length = next_fast_len(length + 1, real=True)
    length *= decimation
    f = rfftfreq(length, 1.0 / path.rate)[: length // decimation // 2 + 1]
    # Means over steps lie in their middle; below Nyquist all three averages are known and invertible.
    exact = np.exp(-1j * np.pi * f / path.rate) / np.sinc(f / path.rate) ** 3
    exact[-1] = 0.0
    return _Post(length, decimation, n // decimation, exact * amplified(path.rig.transducer.amplifier, f), exact)


def amplified(amplifier: Amplifier | None, f: Array) -> Array:
    """Response (f,) of the transducer's amplifier, Butterworth, at frequencies f (Hz)."""
    if amplifier is None:
        return np.ones(len(f), dtype=complex)
    s = 1j * f / float(amplifier.corner)
    k = np.arange(1, amplifier.order + 1)
    poles = np.exp(1j * np.pi * (2 * k + amplifier.order - 1) / (2 * amplifier.order))
    return np.asarray(np.prod(-poles[:, None] / (s[None, :] - poles[:, None]), axis=0))
