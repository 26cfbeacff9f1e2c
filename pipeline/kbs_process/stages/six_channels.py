"""The article's wrench from all six channels at once: few accelerations of rigid bodies make all of it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from kbs_process.plant.rigid import inverse_dynamics, kinematics, links_beyond
from kbs_process.rig.model import TRANSDUCER, Rig, Spacecraft, substitute
from kbs_process.signals.frames import rotate, skew
from kbs_process.signals.records import Array, Mask, Signal
from kbs_process.signals.spatial import wrench_matrix
from kbs_process.stages.to_cog import pose, to_spacecraft

JOINTS = 1.0  # rad/s^2 or m/s^2, prior of a joint's acceleration in a band: far more than any has
FLOOR = (
    1e-5  # m/s^2, rms, prior of the floor's: J. Peterson's high-noise model below 1 Hz, USGS Open-File Report 93-322
)
MOST = 2.0  # chi-square of a degree of freedom that rigid bodies, floor and budget may leave
_POINTS = 100  # of a recording at which the bodies' uncertainty is computed
_BLOCK = 2**12  # instants at a time, which bounds memory


@dataclass(frozen=True, slots=True, eq=False)
class Together:
    """What the article's own motion exerts about the spacecraft's centre of mass, in S."""

    wrench: Signal
    sigma: Array  # (6,) N and N m, rms over the run, by the channels' errors
    bodies: Array  # (6,) the same, by what masses, CoGs and inertias may be wrong by: it grows with the wrench
    chi_square: float  # of a degree of freedom: 1 where rigid bodies explain six channels

    @property
    def explained(self) -> bool:
        """Whether nothing else pulls: a cord makes forces that no acceleration of the article makes."""
        return self.chi_square <= MOST

    def agrees(self, moved: Signal, sigma: Array, most: float) -> Mask:
        """(6,) whether this wrench and the one that was `moved` as measured, of `sigma`, differ by their noise alone.

        Nowhere by over `most` sigmas of their difference, whose variance is the difference of theirs: what is likeliest
        is not correlated with what it leaves.
        """
        apart = np.abs(moved.values - self.wrench.values)[moved.valid].max(axis=0)
        agreed: Mask = apart <= most * np.sqrt(np.maximum(sigma**2 - self.sigma**2, 0.0))
        return agreed


def together(measured: Signal, q: Array, sigma: Array, rig: Rig, spacecraft: Spacecraft) -> Together:
    r"""Estimate the wrench of the joints' accelerations from a disturbance in T, in one band, at angles q (n, joints).

    Equation: $w = G(q) a + M(q) f + e$, weighted least squares at each instant: G the wrench of unit accelerations of
        the joints, M of the floor; a, f and e are normal with the sigmas `JOINTS`, `FLOOR` and `sigma` (6,).
    Units: N, N m; rad.
    Validity: a band well below the resonances, a transducer that stands still, nothing else that pulls at the article.
    """
    n = len(rig.joints)
    weight, known = sigma**-2.0, np.repeat([JOINTS, FLOOR], [n, 3]) ** -2.0
    to_S = wrench_matrix(*pose(spacecraft))
    values, variance, chi = np.zeros_like(measured.values), np.zeros(6), 0.0
    for start in range(0, len(q), _BLOCK):
        rows = slice(start, start + _BLOCK)
        y, valid = measured.values[rows], measured.valid[rows]
        G = _unit_wrenches(rig, q[rows])
        H, a = _accelerations(G, y, weight, known)
        values[rows] = np.einsum("ncj,nj->nc", G[:, :, :n], a[:, :n])
        moved = to_S @ G[:, :, :n]
        variance += np.einsum("nci,nij,ncj->c", moved[valid], H[valid, :n, :n], moved[valid])
        left = y - np.einsum("ncj,nj->nc", G, a)
        chi += float(np.sum((left**2 @ weight + a**2 @ known)[valid]))
    count = max(int(np.count_nonzero(measured.valid)), 1)
    article = measured.derive(values, "rigid bodies' part of all six channels")
    some = np.flatnonzero(measured.valid)[:: max(count // _POINTS, 1)]
    change = np.zeros((len(some), 6))
    for other in _uncertain(rig):
        G = _unit_wrenches(other, q[some])
        _, a = _accelerations(G, measured.values[some], weight, known)
        change += ((np.einsum("ncj,nj->nc", G[:, :, :n], a[:, :n]) - values[some]) @ to_S.T) ** 2
    return Together(
        to_spacecraft(article, spacecraft),
        np.sqrt(variance / count),
        np.sqrt(change.sum(axis=0) / max(len(some), 1)),
        chi / (count * (6 - n)),
    )


def _accelerations(G: Array, y: Array, weight: Array, known: Array) -> tuple[Array, Array]:
    """Covariance (n, k, k) and value (n, k) of the likeliest accelerations behind channels y (n, 6)."""
    H = np.linalg.inv(np.einsum("nci,c,ncj->nij", G, weight, G) + np.diag(known))
    return H, np.einsum("nij,ncj,c,nc->ni", H, G, weight, y)


def _uncertain(rig: Rig) -> Iterator[Rig]:
    """Rigs with one number of one body off by its sigma."""
    for body in rig.bodies:
        for quantity in (body.mass, body.cog, body.inertia):
            for place in np.ndindex(quantity.shape):
                if not quantity.sigma[place] > 0.0:
                    continue
                moved = quantity.value.copy()
                moved[place] += quantity.sigma[place]
                yield substitute(rig, {quantity.name: moved})


def _unit_wrenches(rig: Rig, q: Array) -> Array:
    """(n, 6, joints + 3) what unit accelerations of the joints, and of the floor along T's axes, exert on T."""
    rest = np.zeros_like(q)
    links = kinematics(rig, q, rest, rest)
    static = inverse_dynamics(rig, q, rest, rest, sag=False)
    T, mass, moment = links[TRANSDUCER], 0.0, np.zeros((len(q), 3))
    for body in rig.bodies:
        if body.on in links_beyond(rig):
            link = links[body.on]
            mass += float(body.mass)
            moment += float(body.mass) * (link.r + rotate(link.R, body.cog.value) - T.r)
    shaken = np.zeros((len(q), 6, 3))
    shaken[:, :3] = -mass * np.eye(3)
    shaken[:, 3:] = -skew(rotate(np.swapaxes(T.R, 1, 2), moment))
    units = [inverse_dynamics(rig, q, rest, rest + unit, sag=False) - static for unit in np.eye(q.shape[1])]
    return np.concatenate([np.stack(units, axis=2), shaken], axis=2)
