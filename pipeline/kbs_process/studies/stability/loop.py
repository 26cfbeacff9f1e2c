r"""Stability of the pointing loop: the linearised plant, its drives and the sampled controller, exactly discretised.

Over a cycle Tc the field moves linearly, so its rate is held (a zero-order hold of the rate): the plant's states
s = (x, x') and the field u go from one cycle to the next without approximation as

    exp([[A, B, 0], [0, 0, 1/Tc], [0, 0, 0]] Tc) = [[Phi, G_u, G_v], ...],
    s_{k+1} = Phi s_k + G_u u_k + G_v (u_{k+1} - u_k),
    u_{k+1} = u_k + Kp e_k + Ki Tc S_k,   S_k = S_{k-1} + e_k,   e_k = -y_{k-latency}.

Source: K. J. Astrom and B. Wittenmark, Computer-Controlled Systems (1997), chapters 2 and 5.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.linalg import expm
from scipy.optimize import brentq

from kbs_process.plant.linear.linearise import Linear
from kbs_process.rig.model import Controller
from kbs_process.signals.records import Array
from kbs_process.studies.stability.results import LoopMargins

Complex = npt.NDArray[np.complex128]
_HIGHEST = 1e4  # of gain factors that are tried
_EDGE = 1e-9  # of the unit circle: an integrator without error feedback stands on it


@dataclass(frozen=True, slots=True, eq=False)
class Loop:
    """The loop of n joints cut at their errors: X_{k+1} = A X_k + B e_k, closed by e_k = -C X_k."""

    cycle: float  # s
    joints: tuple[str, ...]
    A: Array  # (N, N) without feedback
    B: Array  # (N, n) of the errors
    C: Array  # (n, N) readings that the errors are made of
    plant: int  # states that are the plant's

    def closed(self) -> Array:
        """Return the closed loop's matrix, (N, N): e = -C X."""
        matrix: Array = self.A - self.B @ self.C
        return matrix

    def response(self, joint: str, f: Array) -> Complex:
        """Return L(f) (n,) of one joint's loop at f Hz, the other joints' loops closed."""
        j = self.joints.index(joint)
        others = [i for i in range(len(self.joints)) if i != j]
        A = self.A - self.B[:, others] @ self.C[others]
        z = np.exp(2j * np.pi * f * self.cycle)
        inner = np.linalg.solve(z[:, None, None] * np.eye(len(A)) - A, self.B[:, j][:, None].astype(complex))
        values: Complex = (inner[..., 0] @ self.C[j]).astype(np.complex128)
        return values


@dataclass(frozen=True, slots=True)
class Critical:
    """Where a growing factor on the gains first makes the loop unstable."""

    factor: float  # inf: not below the largest that is tried
    frequency: float  # Hz, of the oscillation, below half the cycle's rate


def loop(system: Linear, controller: Controller, *, proportional: float = 1.0, integral: float = 1.0) -> Loop:
    """Return the loop of all driven joints with Kp and Ki times a factor each."""
    n, c, T = len(system.joints), len(system.M), float(controller.cycle)
    latency = controller.latency
    Phi, G_u, G_v = discretised(system, T)
    Kp = proportional * np.diag(np.broadcast_to(controller.Kp.value, n))
    Ki = integral * T * np.diag(np.broadcast_to(controller.Ki.value, n))
    s, u, S = slice(0, 2 * c), slice(2 * c, 2 * c + n), slice(2 * c + n, 2 * c + 2 * n)
    first = 2 * c + 2 * n  # readings of one cycle ago, two cycles ago, ...
    size = first + latency * n
    A, B, C = np.zeros((size, size)), np.zeros((size, n)), np.zeros((n, size))
    reads = np.zeros((n, size))
    for j, joint in enumerate(system.joints):
        reads[j, system.output(joint)] = 1.0
    A[s, s], A[s, u], A[s, S], B[s] = Phi, G_u, G_v @ Ki, G_v @ (Kp + Ki)
    A[u, u], A[u, S], B[u] = np.eye(n), Ki, Kp + Ki
    A[S, S], B[S] = np.eye(n), np.eye(n)
    for age in range(latency):
        at = slice(first + age * n, first + (age + 1) * n)
        A[at] = reads if age == 0 else np.eye(size)[first + (age - 1) * n : first + age * n]
    C[:] = reads if latency == 0 else np.eye(size)[size - n :]
    return Loop(T, system.joints, A, B, C, 2 * c)


def discretised(system: Linear, cycle: float) -> tuple[Array, Array, Array]:
    """Return Phi (2c, 2c), G_u (2c, n) and G_v (2c, n) of one cycle, exact for a field that moves linearly in it.

    What becomes of the field on its way to the motor is in G_u and G_v, a lag to first order.
    """
    c, n = len(system.M), len(system.joints)
    of_field, of_rate = np.array(system.arriving or [(1.0, 0.0)] * n).T
    A = np.zeros((2 * c + 2 * n, 2 * c + 2 * n))
    A[:c, c : 2 * c] = np.eye(c)
    A[c : 2 * c, :c] = -np.linalg.solve(system.M, system.K)
    A[c : 2 * c, c : 2 * c] = -np.linalg.solve(system.M, system.C)
    A[c : 2 * c, 2 * c : 2 * c + n] = np.linalg.solve(system.M, system.B) * of_field
    A[c : 2 * c, 2 * c + n :] = np.linalg.solve(system.M, system.B) * of_rate / cycle
    A[2 * c : 2 * c + n, 2 * c + n :] = np.eye(n) / cycle
    exact = expm(A * cycle)
    return exact[: 2 * c, : 2 * c], exact[: 2 * c, 2 * c : 2 * c + n], exact[: 2 * c, 2 * c + n :]


def natural(system: Linear) -> Complex:
    """Return the poles (2c,) 1/s of the plant with its field held."""
    c = len(system.M)
    A = np.zeros((2 * c, 2 * c))
    A[:c, c:] = np.eye(c)
    A[c:, :c], A[c:, c:] = -np.linalg.solve(system.M, system.K), -np.linalg.solve(system.M, system.C)
    values: Complex = np.linalg.eigvals(A).astype(np.complex128)
    return values


def poles(loop: Loop) -> Complex:
    """Return the closed loop's poles as rates (N,) 1/s, log(z) / Tc: those above 1 / (2 Tc) appear folded below it."""
    z = np.linalg.eigvals(loop.closed()).astype(np.complex128)
    rates: Complex = np.asarray(np.log(z[np.abs(z) > 1e-300]) / loop.cycle, np.complex128)  # at nought: a pure delay
    return rates


def radius(loop: Loop) -> float:
    """Return the largest modulus of a closed-loop eigenvalue: above 1 the loop is unstable."""
    return float(np.max(np.abs(np.linalg.eigvals(loop.closed()))))


def critical_near(system: Linear, controller: Controller, factor: float) -> float:
    """Return the critical factor of a system little different from one that has `factor`, faster than `critical`."""

    def excess(logarithm: float) -> float:
        tried = float(np.exp(logarithm))
        return radius(loop(system, controller, proportional=tried, integral=tried)) - 1.0 - _EDGE

    low, high = np.log(0.8 * factor), np.log(1.25 * factor)
    if excess(low) > 0.0 or excess(high) <= 0.0:
        return min(critical(system, controller).factor, _HIGHEST)
    return float(np.exp(brentq(excess, low, high, xtol=1e-9)))


def critical(system: Linear, controller: Controller, *, proportional: float = 1.0, integral: float = 1.0) -> Critical:
    """Return the factor on the gains, Kp times `proportional` and Ki times `integral`, at which stability is lost.

    The first crossing of the unit circle as the factor grows in steps of 3 %, refined by Brent's method.
    """

    def excess(logarithm: float) -> float:
        factor = float(np.exp(logarithm))
        tried = loop(system, controller, proportional=factor * proportional, integral=factor * integral)
        return radius(tried) - 1.0 - _EDGE

    grid = np.arange(np.log(1e-2), np.log(_HIGHEST), 0.03)
    previous = grid[0]
    if excess(previous) > 0.0:
        return Critical(0.0, 0.0)
    for point in grid[1:]:
        if excess(point) > 0.0:
            factor = float(np.exp(brentq(excess, previous, point, xtol=1e-9)))
            there = loop(system, controller, proportional=factor * proportional, integral=factor * integral)
            z = np.linalg.eigvals(there.closed())
            angle = abs(float(np.angle(z[np.argmax(np.abs(z))])))
            return Critical(factor, angle / (2.0 * np.pi * there.cycle))
        previous = point
    return Critical(float("inf"), 0.0)


def margins(loop: Loop, joint: str, angle: float, points: int = 1000) -> LoopMargins:
    """Return the margins of one joint's loop, the others closed, by python-control from its frequency response.

    `angle` rad is the one that the loop is at.
    """
    # Imported here: it takes over a second.
    from control import FrequencyResponseData, stability_margins

    nyquist = 0.5 / loop.cycle
    f = np.unique(np.concatenate([np.geomspace(1e-4 * nyquist, nyquist, points), np.linspace(0, nyquist, points)[1:]]))
    L = loop.response(joint, f)
    gm, pm, sm, gain_w, phase_w, nearest_w = stability_margins(FrequencyResponseData(L, 2.0 * np.pi * f, smooth=True))
    turn = 2.0 * np.pi
    return LoopMargins(
        angle_rad=float(angle),
        joint=joint,
        gain=float(gm) if np.isfinite(gm) and gm > 0.0 else None,
        gain_frequency_Hz=finite(float(gain_w) / turn),
        phase_rad=finite(float(np.radians(pm))),
        phase_frequency_Hz=finite(float(phase_w) / turn),
        sensitivity_peak=1.0 / float(sm),
        sensitivity_frequency_Hz=float(nearest_w) / turn,
    )


def finite(value: float) -> float | None:
    """Return a number, or None where there is none."""
    return float(value) if np.isfinite(value) else None
