"""The port test's material: the mean residual in windows, and what each port of this rig would show there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kbs_process.diagnosis.experiments.floor import Floor, channel_windows
from kbs_process.diagnosis.experiments.hypothesis import coupled
from kbs_process.diagnosis.experiments.thresholds import WINDOW_S
from kbs_process.diagnosis.facts import Place
from kbs_process.diagnosis.nominal.joint import Standing
from kbs_process.diagnosis.nominal.known import Known
from kbs_process.diagnosis.screening.inlets import (
    BASE_PORT,
    GROUND_PORT,
    MOUNTING_PORT,
    WRENCH_PORT,
    Inlet,
    plate_turns,
)
from kbs_process.diagnosis.screening.ports import Cells, Complex, PortModel, sine_window
from kbs_process.diagnosis.screening.transfer import Path, amplified
from kbs_process.plant.rigid import links_beyond
from kbs_process.rig.model import TRANSDUCER, Rig
from kbs_process.signals.records import WRENCH_CHANNELS, Array, Mask

_VARIES = 3  # inputs from which on the eight channels have no room for all of their first-order changes


@dataclass(frozen=True, slots=True, eq=False)
class _Window:
    """Where a window lies, and what whitens its bins."""

    trajectory: int
    start: int
    taper: Array  # (w,)
    bins: NDArray[np.intp]  # (b,)
    f: Array  # (b,) Hz
    weights: Complex  # (b, c, c)
    nu: Array  # (b,)

    def __call__(self, x: Array) -> Complex:
        """Whitened (b, c) of x (n, c), or (b, c, k) of (n, c, k)."""
        piece = x[self.start : self.start + len(self.taper)]
        taper = self.taper.reshape(-1, *(1,) * (x.ndim - 1))
        return self.whiten(np.fft.rfft(piece * taper, axis=0)[self.bins])

    def whiten(self, X: Complex) -> Complex:
        return self.weights @ X if X.ndim == 3 else (self.weights @ X[:, :, None])[:, :, 0]


def cells_and_ports(
    standing: Standing, floor: Floor, paths: Mapping[int, Path]
) -> tuple[Cells, tuple[PortModel, ...], dict[str, Place]]:
    """Residuals and ports over all trajectories that may be fitted; `paths` (by drive) of each one's reference.

    Recordings that have no window without a gap have no cells, and nothing is said of ports.
    """
    known, predicted = standing.known, standing.predicted
    experiment = known.experiment
    names = _ports(experiment.rig, experiment.channels, experiment.loads)
    z, J, nu, t, f, place = [], [], [], [], [], []
    shown: dict[str, list[tuple[Complex, Complex]]] = {name.label: [] for name in names}
    phases = ~np.isfinite(known.parameters.sigma)
    precision = np.where(phases, 0.0, known.parameters.sigma**-2.0)
    for trajectory, repeats in enumerate(experiment.repeats):
        members = [k for k in repeats if k in experiment.fit]
        if not members:
            continue
        reference = experiment.reference(trajectory)
        trials = [experiment.trials[k] for k in members]
        valid = np.logical_and.reduce([trial.valid for trial in trials])
        left = np.mean([experiment.trials[k].measured - standing.shown(k) for k in members], axis=0)
        mean = _level(left, valid)
        slopes = _level(np.moveaxis(known.slopes[reference].columns, 0, 2), valid)
        seen = channel_windows(experiment, trials[0], valid)
        late = np.gradient(predicted[reference].values, experiment.dt, axis=0)
        for window in _windows(known, floor, trajectory, len(members), valid, (predicted[reference].values, seen)):
            z.append(window(mean))
            J.append(window(slopes))
            nu.append(window.nu)
            middle = (window.start + 0.5 * len(window.taper)) * experiment.dt
            t.append(np.full(len(window.f), middle))
            f.append(window.f)
            place.append(np.full(len(window.f), trajectory))
            for label, vectors in _all_shown(names, known, window, paths[reference], late).items():
                shown[label].append(vectors)
    if not z:
        return _no_cells(len(experiment.channels), len(precision)), (), {name.label: name for name in names}
    weights = np.concatenate(z)
    cells = Cells(
        z=weights,
        J=np.concatenate(J),
        seen=np.count_nonzero(np.abs(weights) > 0.0, axis=1),
        precision=precision,
        nu=np.concatenate(nu),
        t=np.concatenate(t),
        f=np.concatenate(f),
        trajectory=np.concatenate(place),
    )
    models = tuple(
        PortModel(label, np.concatenate([h for h, _ in parts]), np.concatenate([v for _, v in parts]))
        for label, parts in shown.items()
    )
    return cells, models, {name.label: name for name in names}


def _no_cells(c: int, p: int) -> Cells:
    none, index = np.zeros(0), np.zeros(0, dtype=np.intp)
    z = np.zeros((0, c), dtype=np.complex128)
    return Cells(z, np.zeros((0, c, p), dtype=np.complex128), index, np.zeros(p), none, none, none, index)


def _ports(rig: Rig, channels: Sequence[str], wrench: int) -> tuple[Place, ...]:
    driven = [joint.name for joint in rig.joints if joint.drive is not None]
    internal = [Place(port, name) for name in driven for port in ("motor torque", "transmission", "joint torque")]
    grounds = [Place("ground torque", name) for name in driven]
    links = [name for name in (TRANSDUCER, *rig.joint_names) if name in links_beyond(rig)]
    outside = [Place("external wrench", link) for link in links] + [Place("base", "")] * bool(links)
    outside += [Place("base torque", "")] * plate_turns(rig)
    sensors = [Place("transducer", "", (name,)) for name in channels[:wrench]]
    encoders = [Place("encoder", name) for name in channels[wrench:]]
    clocks = [Place("clock", "wrench")] + [Place("clock", "encoder")] * bool(encoders)
    return (*internal, *grounds, *outside, *sensors, *encoders, *clocks)


def _inlets(name: Place) -> tuple[Inlet, ...]:
    match name.port:
        case "external wrench":
            return tuple(Inlet(WRENCH_PORT, name.site, axis) for axis in WRENCH_CHANNELS)
        case "base":
            return tuple(Inlet(BASE_PORT, "", axis) for axis in "xyz")
        case "base torque":
            return tuple(Inlet(MOUNTING_PORT, "", axis) for axis in "xyz")
        case "ground torque":
            return (Inlet(GROUND_PORT, name.site),)
        case _:
            return (Inlet(name.port.replace(" ", "_"), name.site),)


def _all_shown(
    names: Sequence[Place], known: Known, window: _Window, path: Path, late: Array
) -> dict[str, tuple[Complex, Complex]]:
    """By label: transfer vectors (b, c, d) in a window and their first-order changes (b, c, e), whitened."""
    experiment = known.experiment
    b, c, dt = len(window.f), len(experiment.channels), experiment.dt
    nothing = np.zeros((b, c, 0), dtype=complex)
    plant = [name for name in names if name.port not in ("transducer", "encoder", "clock")]
    inlets = list(dict.fromkeys(inlet for name in plant for inlet in _inlets(name)))
    middle, reach = (window.start + 0.5 * len(window.taper)) * dt, 0.25 * len(window.taper) * dt
    apart = 0.5 / (len(window.taper) * dt)

    def transfer(time: float, f: Array) -> Complex:
        return window.whiten(_channels(known, frequency_response(path, time, inlets, f)))

    H = transfer(middle, window.f)
    by_pose = transfer(middle + reach, window.f) - transfer(middle - reach, window.f)
    by_time = transfer(middle, window.f + apart) - transfer(middle, window.f - apart)
    shown: dict[str, tuple[Complex, Complex]] = {}
    for name in plant:
        own = [inlets.index(inlet) for inlet in _inlets(name)]
        if len(own) < _VARIES:
            varied = np.concatenate([by_pose[..., own], by_time[..., own]], axis=2)
        else:
            varied = by_time[..., own] if 2 * len(own) < c - 1 else nothing
        shown[name.label] = H[..., own], varied
    for name in names:
        if name.port == "clock":
            part = np.arange(c) < experiment.loads
            shown[name.label] = window(late * (part if name.site == "wrench" else ~part))[:, :, None], nothing
        elif name not in plant:
            touched = name.channels[0] if name.channels else name.site
            unit = np.zeros((b, c, 1), dtype=complex)
            unit[:, experiment.channels.index(touched), 0] = 1.0
            shown[name.label] = window.whiten(unit), nothing
    return shown


def frequency_response(path: Path, time: float, inlets: Sequence[Inlet], f: Array) -> Complex:
    """Response (b, 6 + joints, m) of wrench, behind the amplifier, and joint angles, at the pose of a time (s)."""
    index = int(np.argmin(np.abs(path.knots - time * path.rate)))
    system = path.systems[index]
    chosen = [path.inlets.index(inlet) for inlet in inlets]
    force, direct = path.force[index][:, chosen], path.direct[index][:, chosen]
    s = 2j * np.pi * f[:, None, None]
    x = np.linalg.solve(system.K + s * system.C + s**2 * system.M, np.broadcast_to(force, (len(f), *force.shape)))
    wrench = (system.gravity + s * system.drag - s**2 * system.momentum) @ x + direct
    wrench = wrench * amplified(path.rig.transducer.amplifier, f)[:, None, None]
    angles = x[:, [system.output(name) for name in path.joints]]
    return np.concatenate([wrench, angles], axis=1)


def _channels(known: Known, response: Complex) -> Complex:
    """From six wrench components and all driven joints to the experiment's channels."""
    experiment = known.experiment
    read = coupled(experiment.rig, experiment, np.eye(6)).T
    driven = [joint.name for joint in experiment.rig.joints if joint.drive is not None]
    rows = [6 + driven.index(name) for name in experiment.channels[experiment.loads :]]
    return np.concatenate([read @ response[:, :6], response[:, rows]], axis=1)


def _windows(
    known: Known, floor: Floor, trajectory: int, repeats: int, valid: Mask, shown: tuple[Array, Array]
) -> list[_Window]:
    """Windows without gaps; `shown` is the predicted path (n, c), and the tapers (n, c) of what channels show of it."""
    path, seen = shown
    experiment = known.experiment
    trial = experiment.trials[[t.trajectory for t in experiment.trials].index(trajectory)]
    dt = experiment.dt
    short = round(WINDOW_S / dt)
    stretches = _stretches(valid)
    spans = [
        (start, short, experiment.highest_Hz)
        for first, length in stretches
        for start in range(first, first + length - short + 1, short)
    ]
    # What is slower than a window shows is looked at over all of the trial, where the plant is stiff.
    longest = max(stretches, key=lambda stretch: stretch[1], default=(0, 0))
    if longest[1] > 2 * short:
        spans.insert(0, (*longest, 2.0 / (short * dt) * (1.0 - 1e-9)))
    found = []
    for start, width, highest in spans:
        part = slice(start, start + width)
        # The first frequency is the second that a window holds: below, its own trend is what it sees.
        bins = np.arange(2, int(highest * width * dt) + 1, 2)
        f = bins / (width * dt)
        channels = np.all(seen[part][1:-1] > 0.0, axis=0)
        density = floor.repeats(trial, f) / repeats
        density = density + floor.shared(trial, path, seen, f)[:, :, None] * np.eye(density.shape[1])
        # A channel that shows nothing is one of unit noise without any relation to the others.
        relation = density * np.outer(channels, channels) + np.diag(1.0 * ~channels)
        weights = np.linalg.inv(np.linalg.cholesky(relation)) * np.sqrt(2.0 * dt)
        found.append(_Window(trajectory, start, sine_window(width), bins, f, weights * channels, floor.freedom(f)))
    return found


def _stretches(valid: Mask) -> list[tuple[int, int]]:
    """Start and length of every stretch without a gap."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], valid.astype(np.int8), [0]])))
    return [(int(start), int(end - start)) for start, end in edges.reshape(-1, 2)]


def _level(x: Array, valid: Mask) -> Array:
    """Constant and slope taken off: zero and drift of a transducer."""
    t = np.linspace(-1.0, 1.0, len(x))
    A = np.stack([np.ones_like(t), t], axis=1)
    flat = x.reshape(len(x), -1)
    weighted = A * valid[:, None]
    left: Array = flat - A @ np.linalg.solve(weighted.T @ A, weighted.T @ flat)
    return left.reshape(x.shape)
