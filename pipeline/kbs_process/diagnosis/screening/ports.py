r"""Which port, were its input free to be anything, would explain the residual: windows by frequencies.

In a window and at a frequency the whitened mean residual z (c,) of M repeats is H u + noise if all enters at a port of
transfer vectors H (c, d). What is left of z outside H's span,

    Q = |z - H (H^H H)^{-1} H^H z|^2,   (nu - q + 1) / (q nu) Q ~ F(2 q, 2 (nu - q + 1)),   q = c - d,

nu being the floor's degrees of freedom. Inside a window the input's envelope and the pose change, which
turns H u into H u + H' u_1 + H_pose u_2 to first order: these directions are free too. What the transfer is uncertain
by is added to the noise. Known parameters are refitted to what a port leaves. Windows have sine tapers and
frequencies lie 2/T apart, which makes cells independent. Cells combine by Fisher, ports by Holm.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2
from scipy.stats import f as fisher_f

from kbs_process.diagnosis.experiments.thresholds import CELL_ALPHA, PORT_ALPHA, PORT_ERROR, RIVALS
from kbs_process.estimation.tails import log_tail
from kbs_process.signals.records import Array

Complex = NDArray[np.complex128]
_LEAST_P = 1e-300
_DEPENDENT = 1e-6  # singular value, of unit columns


@dataclass(frozen=True, slots=True, eq=False)
class Cells:
    """Whitened mean residual in windows by frequencies, all trajectories in one row of cells.

    One complex number has unit variance. `J` holds what the known parameters do, a column each.
    """

    z: Complex  # (cells, c), zero where a channel shows nothing
    J: Complex  # (cells, c, p)
    seen: NDArray[np.intp]  # (cells,) channels that show something
    precision: Array  # (p,) prior's
    nu: Array  # (cells,) degrees of freedom of the floor; inf where it is declared
    t: Array  # (cells,) s, middle of the window
    f: Array  # (cells,) Hz
    trajectory: NDArray[np.intp]  # (cells,)


@dataclass(frozen=True, slots=True, eq=False)
class PortModel:
    """What a port shows in every cell: leading transfer vectors, then directions in which these vary in a window."""

    name: str
    H: Complex  # (cells, c, d) whitened
    varied: Complex  # (cells, c, e) first-order changes of H in a window, whitened; e may be 0


@dataclass(frozen=True, slots=True, eq=False)
class PortVerdict:
    """How well one port does."""

    name: str
    inputs: int  # d
    log_p: float  # natural logarithm, Fisher's of all cells
    sufficient: bool  # after Holm
    explained: float  # share of the residual's power beyond noise that the port takes away
    left: float  # mean of Q over its expectation: 1 where the port suffices
    cells: Array  # (cells,) p-values
    alike: tuple[str, ...]  # ports that these channels cannot tell from it


@dataclass(frozen=True, slots=True, eq=False)
class PortTest:
    """Verdict on every port, best first, and where there is anything at all."""

    ports: tuple[PortVerdict, ...]
    significant: NDArray[np.bool_]  # (cells,) after Benjamini and Yekutieli
    log_p: float  # of no input anywhere

    @property
    def only(self) -> tuple[str, ...]:
        """The port of one input that suffices, and those like it; nothing, if one that is unlike does, too.

        Nor, if one of several inputs does that looks the same: it may be along one of these.
        """
        able = [port for port in self.ports if port.sufficient]
        one = [port for port in able if port.inputs == 1]
        if self.log_p > np.log(PORT_ALPHA) or not one:
            return ()
        best = one[0]
        apart = any(port is not best and port.name not in best.alike for port in one)
        within = any(port.inputs > 1 and port.name in best.alike for port in able)
        return () if apart or within else tuple(port.name for port in one)


def sine_window(n: int) -> Array:
    """(n,) taper of unit power whose cells 2/T apart are uncorrelated for white noise."""
    w = np.sin(np.pi * (np.arange(n) + 0.5) / n)
    return np.asarray(w / np.sqrt(np.sum(w**2)), dtype=np.float64)


def port_test(cells: Cells, ports: Sequence[PortModel], transfer_error: float = PORT_ERROR) -> PortTest:
    """Test every port alone; see the module."""
    none, nothing_left = _left_over(cells, None, 0.0)
    verdicts = []
    for port in ports:
        p, left = _left_over(cells, port, transfer_error)
        # Power of the noise taken off, what remains after the port over what there was; of nothing it takes nothing.
        before = nothing_left - 1.0
        verdicts.append((port, p, left, 1.0 - max(left - 1.0, 0.0) / before if before > 0.0 else 0.0))
    logs = np.array([fisher(p) for _, p, _, _ in verdicts])
    # Holm: a port is refused if its p-value, times how many are no better refused, is small. The rest suffice.
    order = np.argsort(logs)
    sufficient = np.ones(len(ports), dtype=bool)
    for rank, index in enumerate(order):
        if logs[index] + np.log(len(ports) - rank) > np.log(PORT_ALPHA):
            break
        sufficient[index] = False
    classes = alike(cells, ports)
    found = [
        PortVerdict(port.name, port.H.shape[2], float(logs[i]), bool(sufficient[i]), share, left, p, classes[port.name])
        for i, (port, p, left, share) in enumerate(verdicts)
    ]
    found.sort(key=lambda v: (not v.sufficient, v.inputs if v.sufficient else 0, v.left))
    return PortTest(tuple(found), benjamini_yekutieli(none, CELL_ALPHA), fisher(none))


def _left_over(cells: Cells, port: PortModel | None, error: float) -> tuple[Array, float]:
    """P-value of each cell that a port leaves nothing but noise, and the mean of Q / q."""
    n, c = cells.z.shape
    z, J, inflation, q = cells.z, cells.J, np.ones(n), cells.seen
    if port is not None:
        basis, d = _basis(np.concatenate([port.H, port.varied], axis=2))
        taken = np.einsum("ncd,nc->nd", basis.conj(), z)
        z = z - np.einsum("ncd,nd->nc", basis, taken)
        J = J - basis @ (basis.conj().swapaxes(1, 2) @ J)
        power = np.maximum(np.sum(np.abs(taken) ** 2, axis=1) - d, 0.0)
        inflation = 1.0 + error**2 * power / c
        q = q - d
    # Known parameters take what they can of it; a complex number of unit variance counts twice.
    weight = np.repeat(np.sqrt(2.0 / inflation), c)
    A = J.reshape(n * c, -1) * weight[:, None]
    y = z.ravel() * weight
    H = (A.conj().T @ A).real + np.diag(cells.precision)
    if len(H):
        size = np.sqrt(np.maximum(np.diag(H), 1e-300))
        step = np.linalg.lstsq(H / np.outer(size, size), (A.conj().T @ y).real / size, rcond=1e-12)[0] / size
        y = y - A @ step
    Q = np.sum(np.abs(y.reshape(n, c)) ** 2, axis=1) / 2.0
    return _tail(Q, q, cells.nu), float(np.sum(Q) / max(np.sum(np.maximum(q, 0)), 1.0))


def _basis(H: Complex) -> tuple[Complex, NDArray[np.intp]]:
    """Orthonormal columns (cells, c, d) of each cell's span, zero beyond its rank, and the ranks (cells,)."""
    size = np.linalg.norm(H, axis=1, keepdims=True)
    U, s, _ = np.linalg.svd(H / np.where(size > 0.0, size, 1.0), full_matrices=False)
    kept = s > _DEPENDENT
    return np.asarray(U * kept[:, None, :], dtype=np.complex128), np.count_nonzero(kept, axis=1)


def _tail(Q: Array, q: NDArray[np.intp], nu: Array) -> Array:
    """P(Q' > Q) of q complex numbers whitened by an estimate with nu degrees of freedom; 1 where nothing is left."""
    known, nothing, q = ~np.isfinite(nu), q <= 0, np.maximum(q, 1)
    freedom = np.where(known, 1e9, np.maximum(nu, q + 1.0))
    p = fisher_f.sf((freedom - q + 1.0) / (q * freedom) * Q, 2 * q, 2.0 * (freedom - q + 1.0))
    p = np.where(known, chi2.sf(2.0 * Q, 2 * q), p)
    return np.asarray(np.where(nothing, 1.0, np.maximum(p, _LEAST_P)), dtype=np.float64)


def fisher(p: Array) -> float:
    """Natural logarithm of Fisher's combined p-value of independent ones."""
    return log_tail(float(-2.0 * np.sum(np.log(p))), 2 * len(p))


def benjamini_yekutieli(p: Array, alpha: float) -> NDArray[np.bool_]:
    """Which of many p-values, dependent in any way, are significant at a false-discovery rate."""
    n = len(p)
    order = np.argsort(p)
    bound = alpha * np.arange(1, n + 1) / (n * np.sum(1.0 / np.arange(1, n + 1)))
    below = np.flatnonzero(p[order] <= bound)
    chosen = np.zeros(n, dtype=bool)
    if len(below):
        chosen[order[: below[-1] + 1]] = True
    return chosen


def alike(cells: Cells, ports: Sequence[PortModel]) -> dict[str, tuple[str, ...]]:
    """For each port those that these recordings cannot tell from it.

    What the port's own best input shows is fitted by the other port, input and first-order changes free: twice the
    power left, less what noise leaves, is rho_delta^2.
    """
    own = {port.name: _basis(port.H)[0] for port in ports}
    free = {port.name: _basis(np.concatenate([port.H, port.varied], axis=2))[0] for port in ports}
    found: dict[str, tuple[str, ...]] = {}
    for one in ports:
        Q = own[one.name]
        shown = Q @ (Q.conj().swapaxes(1, 2) @ cells.z[:, :, None])
        others = []
        for other in ports:
            P = free[other.name]
            left = shown - P @ (P.conj().swapaxes(1, 2) @ shown)
            across = P.conj().swapaxes(1, 2) @ Q
            noise = float(np.sum(np.abs(Q) ** 2) - np.sum(np.abs(across) ** 2))
            if other is not one and 2.0 * (float(np.sum(np.abs(left) ** 2)) - noise) < RIVALS**2:
                others.append(other.name)
        found[one.name] = tuple(others)
    return found
