r"""On the transducer the paper's other way: the rigid-base interface wrench through a modal model.

A unit with coordinates y on a plate with coordinates a (the interface), on the transducer's springs:

    M_aa a'' + M_ay y'' + C_a a' + K_a a = 0,      M_ya a'' + M_yy y'' + C_y y' + K_y y = f.

On a rigid base (a = 0) the same forces f move the unit by y_r and load the interface with w_r = -M_ay y_r''. With
y = y_r + d the forces drop out: the interface and d answer w_r, as a load on the plate, like the whole structure on its
springs does. So with the structure's modes phi_k, of unit modal mass, it holds without approximation that

    eta_k'' + 2 zeta_k w_k eta_k' + w_k^2 eta_k = phi_ka . w_r,     w = w_r + sum_k (G_k eta_k - P_k eta_k''),

where phi_ka is the mode's motion at the interface, P_k = M_a phi_k its participation (momentum at the interface:
P_k P_k^T is its effective mass), and G_k what gravity adds as the mode tilts the unit. Written with the second
derivative, a mode left out costs (f / f_k)^2 of its part and no static error (mode acceleration).

Validity: linear (small motions of the drives about their state), modal damping, a configuration that stands still
while a mode rings; its slow change is followed from one tabulated pose to the next. In the coupled plant friction
answers the plate's motion; here it does not.
Source: R. R. Craig and A. J. Kurdila, Fundamentals of Structural Dynamics (2006), chapter 11; effective masses as in
ECSS-E-HB-32-26A, Spacecraft mechanical loads analysis handbook (2013).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.fft import irfft, next_fast_len, rfft, rfftfreq
from scipy.linalg import eigh
from scipy.optimize import linear_sum_assignment

from kbs_process.plant.effect import Effect
from kbs_process.plant.linear.linearise import linearise
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Array

HIGHEST_HZ = 100.0  # of the modes kept: what is left out of the others at f is (f / HIGHEST_HZ)^2
_STRETCH_S = 4.0  # in which the structure's pose counts as one
_RUNG_DOWN = 1e-4  # to which a mode has decayed where its response is cut off


@dataclass(frozen=True, slots=True, eq=False)
class ModalModel:
    """m modes of the article on the transducer at one pose, of unit modal mass; six components are F, M or v, omega."""

    angle: float  # rad, of the table's joint
    frequency: Array  # (m,) Hz
    frequency_sigma: Array  # (m,) Hz
    damping: Array  # (m,) of critical
    damping_sigma: Array  # (m,)
    shape: Array  # (6, m) motion of the interface: kg^-1/2, and rad/(m kg^1/2) in its last three rows
    participation: Array  # (6, m) kg^1/2, and kg^1/2 m
    gravity: Array  # (6, m) change of the weight's wrench with the mode: N and N m, times kg^-1/2 /m

    @property
    def effective(self) -> Array:
        """Effective masses (kg) and moments of inertia (kg m^2) of each mode, (6, m)."""
        squared: Array = self.participation**2
        return squared

    def compliance(self, f: Array) -> npt.NDArray[np.complex128]:
        """Motion of the interface (n, 6, 6), m and rad, for a wrench on a rigid base, at f (n,) Hz: see `transfer`."""
        answer = self._answer(f)
        moved: npt.NDArray[np.complex128] = np.einsum("ik,nk,jk->nij", self.shape, answer, self.shape)
        return moved

    def _answer(self, f: Array) -> npt.NDArray[np.complex128]:
        """Motion (n, m) of each mode for a unit load on it."""
        w, wk = 2.0 * np.pi * np.asarray(f, dtype=float)[:, None], 2.0 * np.pi * self.frequency
        return np.asarray(1.0 / (wk**2 - w**2 + 2j * self.damping * wk * w), dtype=np.complex128)

    def transfer(self, f: Array) -> npt.NDArray[np.complex128]:
        """H(f), (n, 6, 6): wrench on the transducer for one on a rigid base, at f (n,) Hz.

        H = I + sum_k (w^2 P_k + G_k) phi_k^T / (w_k^2 - w^2 + 2 i zeta_k w_k w).
        """
        w, answer = 2.0 * np.pi * np.asarray(f, dtype=float)[:, None], self._answer(f)
        H: npt.NDArray[np.complex128] = np.einsum("ik,nk,jk->nij", self.participation, answer * w**2, self.shape)
        H += np.einsum("ik,nk,jk->nij", self.gravity, answer, self.shape)
        H += np.eye(6)
        return H


Transfer = Callable[[ModalModel, Array], npt.NDArray[np.complex128]]


@dataclass(frozen=True, slots=True, eq=False)
class ModalTable:
    """Modal models at poses of one joint, in the order of its angle; mode k is the same mode in all of them."""

    joint: str
    models: tuple[ModalModel, ...]
    source: str

    def at(self, angle: float) -> ModalModel:
        """Return the model at an angle (rad), linear between the tabulated ones, held outside."""
        angles = [model.angle for model in self.models]
        place = float(np.interp(angle, angles, np.arange(len(angles))))
        low = min(int(place), max(0, len(angles) - 2))
        here, there = self.models[low], self.models[min(low + 1, len(angles) - 1)]
        share = place - low

        def between(name: str) -> Array:
            value: Array = (1.0 - share) * getattr(here, name) + share * getattr(there, name)
            return value

        return ModalModel(angle, *(between(name) for name in _FIELDS))


_FIELDS = tuple(ModalModel.__dataclass_fields__)[1:]


def derive(
    rig: Rig, effects: Sequence[Effect], joint: str, angles: Array, q: Array, *, highest_Hz: float = HIGHEST_HZ
) -> ModalTable:
    """Derive the modal models from the plant itself at angles (p,) rad of `joint`, the others at q (joints,).

    Damping is that of the linear plant, diagonal in its modes; frequencies' sigma comes from the transducer's
    stiffness, that of damping from the transducer's damping. Slopes of friction are as in `linear.linearise`.
    """
    index = rig.joint_names.index(joint)
    models = []
    for angle in np.sort(angles):
        pose = np.array(q, dtype=float)
        pose[index] = angle
        models.append(_derived(rig, effects, pose, float(angle), highest_Hz))
    kept = min(len(model.frequency) for model in models)
    models = [select_modes(model, np.arange(kept, dtype=np.intp)) for model in models]
    return ModalTable(joint, tracked(models), "derived from the plant's parameters")


def _derived(rig: Rig, effects: Sequence[Effect], pose: Array, angle: float, highest_Hz: float) -> ModalModel:
    system = linearise(rig, effects, pose)
    squared, shapes = eigh(system.K, system.M)
    w = np.sqrt(squared)
    kept = w < 2.0 * np.pi * highest_Hz
    w, shapes = w[kept], shapes[:, kept]
    plate = np.zeros((6, len(w)))
    frequency_sigma, damping_sigma = np.zeros(len(w)), np.zeros(len(w))
    stiffness, damper = rig.transducer.stiffness, rig.transducer.damping
    if system.plate and stiffness is not None:
        plate[3:] = shapes[:3]
        frequency_sigma = np.linalg.norm(stiffness.sigma[:, None] * shapes[:3] ** 2, axis=0) / (4 * np.pi * w)
        if damper is not None:
            damping_sigma = np.linalg.norm(damper.sigma[:, None] * shapes[:3] ** 2, axis=0) / (2.0 * w)
    return ModalModel(
        angle=angle,
        frequency=w / (2.0 * np.pi),
        frequency_sigma=frequency_sigma,
        damping=np.einsum("ik,ij,jk->k", shapes, system.C, shapes) / (2.0 * w),
        damping_sigma=damping_sigma,
        shape=plate,
        participation=system.momentum @ shapes,
        gravity=system.gravity @ shapes,
    )


def select_modes(model: ModalModel, order: npt.NDArray[np.intp]) -> ModalModel:
    """Return the modes of a model in another order, or some of them."""
    return ModalModel(model.angle, *(getattr(model, name)[..., order] for name in _FIELDS))


def tracked(models: Sequence[ModalModel]) -> tuple[ModalModel, ...]:
    """Bring the modes of neighbouring poses into one order and sign: those whose participations are most alike.

    Modes may cross as the joint turns; their order by frequency then says nothing. All models have the same number of
    modes. The likeness is the cosine between participations, with the mean of either row as its unit.
    """
    unit = np.sqrt(np.mean([np.mean(model.effective, axis=1) for model in models], axis=0))[:, None]
    unit[unit == 0.0] = 1.0
    followed = [models[0]]
    for model in models[1:]:
        before, after = (m.participation / unit for m in (followed[-1], model))
        lengths = np.outer(np.linalg.norm(before, axis=0), np.linalg.norm(after, axis=0))
        cosine = (before.T @ after) / np.where(lengths > 0.0, lengths, 1.0)
        _, order = linear_sum_assignment(-np.abs(cosine))
        chosen = select_modes(model, np.asarray(order, dtype=np.intp))
        sign = np.where(cosine[np.arange(len(order)), order] < 0.0, -1.0, 1.0)
        followed.append(
            ModalModel(
                chosen.angle, *(getattr(chosen, n) * (sign if getattr(chosen, n).ndim == 2 else 1.0) for n in _FIELDS)
            )
        )
    return tuple(followed)


def respond(load: Array, dt: float, angle: Array, table: ModalTable, transfer: Transfer = ModalModel.transfer) -> Array:
    """Return the wrench (n, 6) on the transducer, or another `transfer`, for `load` (n, 6) on a rigid base.

    Samples come every dt s.

    `angle` (n,) rad is that of the table's joint. Every stretch of the load, under a Hann window that overlaps its
    neighbours' by a half, is answered by the structure as it then stands, and rings on beyond its end. Exact for
    loads without content above the Nyquist frequency; beyond the record the load is held.
    """
    hop = max(1, round(_STRETCH_S / dt))
    slowest = min(float(np.min(m.damping * 2.0 * np.pi * m.frequency)) for m in table.models)
    ring = int(np.ceil(-np.log(_RUNG_DOWN) / (slowest * dt)))
    lead = hop * int(np.ceil(ring / hop))
    held = np.pad(load, ((lead, lead), (0, 0)), mode="edge")
    length = next_fast_len(2 * hop + ring, real=True)
    f = rfftfreq(length, dt)
    window = np.sin(np.pi * (np.arange(2 * hop) + 0.5) / (2 * hop)) ** 2
    answer = np.zeros((len(held) + length, 6))
    for start in range(-hop, len(held), hop):
        inside = slice(max(start, 0), min(start + 2 * hop, len(held)))
        piece = np.zeros((2 * hop, 6))
        piece[inside.start - start : inside.stop - start] = held[inside]
        middle = min(max(start + hop - lead, 0), len(angle) - 1)
        H = transfer(table.at(float(angle[middle])), f)
        spectrum = np.einsum("nij,nj->ni", H, rfft(piece * window[:, None], length, axis=0))
        rung = irfft(spectrum, length, axis=0)
        skipped = max(0, -start)
        answer[start + skipped : start + length] += rung[skipped:]
    return answer[lead : lead + len(load)]
