"""Where tooth contact begins and ends, searched over the whole turn.

A Coulomb friction that is there while |wrap(psi + phi)| < delta begins at psi = -phi - delta and ends at -phi + delta;
either edge meets its own events, and the cost has minima in which one edge is right and the other is not. But while the
rotor moves, friction torques add: a contact's response is the sum of those of the narrow contacts that it is made of.
So the plant runs with each narrow contact once, and every pair of edges is judged from these by linear least squares,
its torque and all other numbers following. Only the search is one of edges: they are linear in phi and delta, so that
a descent takes the same steps in either.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from kbs_process.estimation.fit import Parameters
from kbs_process.identification.screening import Contact
from kbs_process.signals.records import Array

Residuals = Callable[[Sequence[Array]], list[Array]]  # whitened residual (n,) at each of some points (p,)

_NARROW = 32  # contacts in a turn
_FINE = 4  # places of an edge in a narrow contact
_SEEN = 0.1  # of noise, by one prior sigma of torque: friction at a place that shows less is not judged


def edge_minima(
    residuals: Residuals, theta: Array, J: Array, parameters: Parameters, contact: Contact, most: int
) -> list[Array]:
    """Return up to `most` points like `theta` (p,) with the contact moved, best first: local minima over both edges.

    J (n, p): slopes of the residual at `theta`, by which the other numbers follow.
    """
    own = [contact.torque, contact.width, contact.phase]
    rest = np.delete(np.arange(len(theta)), own)
    responses, off = _responses(residuals, theta, parameters, contact)
    gram, slope = _others_following(responses, off, J, theta, parameters, rest)
    places = []
    for torque, begin, width in _minima(gram, slope, parameters, contact)[:most]:
        moved = theta.copy()
        moved[own] = torque, 0.5 * width, -(begin + 0.5 * width)
        # The turn that is nearest to where it was.
        moved[contact.phase] += 2.0 * np.pi * np.rint((theta - moved)[contact.phase] / (2.0 * np.pi))
        places.append(moved)
    return places


def left_to_contact(
    residuals: Residuals, theta: Array, J: Array, parameters: Parameters, contact: Contact
) -> tuple[float, int]:
    """Return what a friction that is free at every place of the turn would gain, and its degrees of freedom.

    A score test (C. R. Rao, Proc. Cambridge Phil. Soc. 44:50, 1948) in the directions of the narrow contacts, all
    numbers following by J (n, p): chi-square where `theta` is right and the residual's noise white, whatever the
    directions; more where the contact is in a wrong place, or not of the shape that the model gives it.
    """
    responses, _ = _responses(residuals, theta, parameters, contact)
    (r,) = residuals([theta])
    gram, slope = _others_following(responses, r, J, theta, parameters, np.arange(len(theta)))
    square, directions = np.linalg.eigh(gram)
    shown = square > (_SEEN / parameters.sigma[contact.torque]) ** 2
    along = directions[:, shown].T @ slope
    return float(np.sum(along**2 / square[shown])), int(np.count_nonzero(shown))


def _others_following(
    responses: Array, r: Array, J: Array, theta: Array, parameters: Parameters, others: NDArray[np.intp]
) -> tuple[Array, Array]:
    """Information (k, k) on amplitudes of `responses` (n, k) in r (n,), and slope (k,); `others` follow."""
    weight = parameters.sigma[others] ** -2.0
    excess = weight * (theta - parameters.value)[others]
    J = J[:, others]
    cross = J.T @ responses
    solved = np.linalg.solve(J.T @ J + np.diag(weight), np.column_stack([cross, J.T @ r + excess]))
    return responses.T @ responses - cross.T @ solved[:, :-1], responses.T @ r - cross.T @ solved[:, -1]


def _responses(residuals: Residuals, theta: Array, parameters: Parameters, contact: Contact) -> tuple[Array, Array]:
    """Of narrow contacts side by side from -pi on, (n, narrow) per N m, and the residual without any (n,)."""
    points = [theta.copy()]
    points[0][contact.torque] = 0.0
    for k in range(_NARROW):
        one = theta.copy()
        one[contact.torque] = parameters.value[contact.torque]
        one[contact.width] = np.pi / _NARROW
        one[contact.phase] = np.pi - (2 * k + 1) * np.pi / _NARROW
        points.append(one)
    off, *found = residuals(points)
    return (np.column_stack(found) - off[:, None]) / parameters.value[contact.torque], off


def _minima(gram: Array, slope: Array, parameters: Parameters, contact: Contact) -> list[tuple[float, float, float]]:
    """Torque, where it begins and how wide it is, of the local minima of -2 log posterior, best first."""
    places = _NARROW * _FINE
    step = 2.0 * np.pi / places
    # Share of each narrow contact that lies before an edge; a second turn for contacts across its end.
    edge = np.arange(2 * places)[:, None] / _FINE - np.arange(_NARROW)
    before = np.clip(edge, 0.0, 1.0) + np.clip(edge - _NARROW, 0.0, 1.0)
    begin, width = np.meshgrid(np.arange(places), np.arange(1, places), indexing="ij")
    covered = before[begin + width] - before[begin]
    half = 0.5 * step * width
    mean, sigma = parameters.value, parameters.sigma
    curvature = np.einsum("...i,ij,...j", covered, gram, covered) + sigma[contact.torque] ** -2.0
    pull = covered @ slope - mean[contact.torque] * sigma[contact.torque] ** -2.0
    torque = np.maximum(-pull / curvature, 0.0)
    cost = torque * (torque * curvature + 2.0 * pull)
    cost += ((half - mean[contact.width]) / sigma[contact.width]) ** 2
    around = np.pad(np.pad(cost, ((1, 1), (0, 0)), mode="wrap"), ((0, 0), (1, 1)), constant_values=np.inf)
    least = np.min(
        [around[1 + i : 1 + i + cost.shape[0], 1 + j : 1 + j + cost.shape[1]] for i in (-1, 0, 1) for j in (-1, 0, 1)],
        axis=0,
    )
    rows, columns = np.nonzero((cost <= least) & (torque > 0.0))
    order = np.argsort(cost[rows, columns], kind="stable")
    return [
        (float(torque[i, j]), float(-np.pi + step * i), float(step * (j + 1)))
        for i, j in zip(rows[order], columns[order], strict=True)
    ]
