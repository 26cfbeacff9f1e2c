"""Whether a law's size is one that it may have: what is not is no law, however well it fits.

A law with free amplitudes follows whatever a wrong number or a damaged recording leaves, and the less it has to do with
it, the larger they come out: an encoder that is eccentric by a radian. Every amplitude has bounds in the catalogue.
Amplitudes of one law that undo each other, as the constant and the tail of a spring that stiffens towards one end, are
judged by what they do together.
Those of sensors and clocks, which do not grow with the rig as torques do, have a spread that says what is usual, too.
A friction takes work out of the mechanism: one that puts work in stands in for something else.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping

import numpy as np

from kbs_process.diagnosis.proposing.curves import CurveSuspect, along
from kbs_process.diagnosis.screening.screen import Catalogued, Suspect
from kbs_process.diagnosis.screening.signature import port_inputs
from kbs_process.diagnosis.screening.suspects import Candidate
from kbs_process.plant.effect import Effect, Law
from kbs_process.signals.records import Array

_SIGMAS = 3.0  # by which an amplitude has to be beyond, or work be done by what is said to take it
_SHARE = 0.1  # of the work that it does and takes, below which what it does is the motion's asymmetry


def undone(suspect: Catalogued, amplitudes: Mapping[str, float]) -> frozenset[str]:
    """Return the amplitudes of a law of the plant that may have any value, as others undo what they do.

    Along all motions the law does no more than such an amplitude would alone, at the bound of its values.
    """
    candidate, scene = suspect.candidate, suspect.scene
    if not isinstance(candidate.effect, Effect) or candidate.again:
        return frozenset()
    rig = scene.hypothesis.rig
    units = np.concatenate([port_inputs(candidate, tapped, rig) for tapped in scene.signals.values()])
    together = np.max(np.abs(np.einsum("nmc,m->nc", units, [amplitudes[e.name] for e in candidate.amplitudes])))
    alone = np.max(np.abs(units), axis=(0, 2))
    return frozenset(
        entry.name
        for entry, one in zip(candidate.amplitudes, alone, strict=True)
        if together <= one * max(map(abs, entry.bounds))
    )


def implausible(law: Law, amplitudes: Mapping[str, tuple[float, float]], free: Collection[str] = ()) -> tuple[str, ...]:
    """Return why a law is refused that has amplitudes of such values and sigmas, by name; nothing, if it may have.

    Those that are `free` may have any.
    """
    reasons = []
    for parameter in law.amplitudes:
        if parameter.name not in amplitudes or parameter.name in free:
            continue
        value, sigma = amplitudes[parameter.name]
        least, most = law.plausible(parameter)
        # Written so that what is no number is refused.
        if not least - _SIGMAS * sigma <= value <= most + _SIGMAS * sigma:
            unit = "" if parameter.unit == "1" else f" {parameter.unit}"
            reasons.append(f"{parameter.name} = {value:.3g}{unit}, and it may be {least:.3g} to {most:.3g}{unit}")
    return tuple(reasons)


def oversized(
    suspect: Suspect, values: Iterable[float], sigmas: Iterable[float], free: Collection[str] = ()
) -> tuple[str, ...]:
    """Why a law of the catalogue does not have amplitudes of such values and sigmas; nothing, if it may.

    Those that are `free` may have any.
    """
    if not isinstance(suspect, Catalogued):
        return ()
    numbers = zip(map(float, values), map(float, sigmas), strict=True)
    named = dict(zip(suspect.amplitudes, numbers, strict=False))
    return tuple(reason for action in suspect.candidate.actions for reason in implausible(action.effect, named, free))


def drives(suspect: Catalogued, amplitudes: Array, covariance: Array) -> tuple[str, ...]:
    r"""Return why a friction of such amplitudes (m,), covariance (m, m), is none; nothing, if it may be one.

    Equation: $W = \sum_j a_j \sum_t T_j(t) \omega(t) \, dt$ over all trajectories, $T_j$ the torque of a unit of
        amplitude j at the screen's shape, $\omega$ the rate at its port.
    Units: N m, rad/s, s -> J.
    Validity: work that is done counts where it is more than a tenth of all that is done and taken. The friction of
        the nominal model is known to its sigmas and refitted: less of it is no find.
    Source: J. C. Willems, Dissipative dynamical systems I, Arch. Rational Mech. Anal. 45 (1972) 321.
    """
    candidate = suspect.candidate
    if not (isinstance(candidate.effect, Effect) and candidate.effect.brakes):
        return ()
    # Several actions of one law have amplitudes one after the other.
    actions = len(amplitudes) // len(candidate.amplitudes)
    power = np.tile(_power(suspect, candidate, candidate.port.rate), actions)
    work, all_of_it = power.sum(axis=0), float(np.abs(power @ amplitudes).sum())
    done, variance = float(work @ amplitudes), float(work @ (covariance @ work))
    if not done > max(_SIGMAS * float(np.sqrt(max(variance, 0.0))), _SHARE * all_of_it):
        return ()
    return (f"does work of {done:.3g} J in these motions, and friction takes it",)


def pushes(suspect: CurveSuspect, coefficients: Array, covariance: Array) -> tuple[str, ...]:
    """Return why a measured friction is none: along its table it pushes more than it brakes; nothing, if it may be."""
    if not suspect.law.opposed:
        return ()
    mean = suspect.basis(along(suspect.law, *suspect.ends)).mean(axis=0)
    value, variance = float(mean @ coefficients), float(mean @ covariance @ mean)
    if not value < -_SIGMAS * float(np.sqrt(max(variance, 0.0))):
        return ()
    return (f"pushes with {-value:.3g} N m along its table, and friction brakes",)


def _power(suspect: Catalogued, candidate: Candidate, rate: str) -> Array:
    """(n, m) J that a unit of each amplitude does from tap to tap, along all trajectories end to end."""
    scene = suspect.scene
    parts = []
    for tapped in scene.signals.values():
        torque = port_inputs(candidate, tapped, scene.hypothesis.rig)[:, :, 0]
        speed = tapped.values[:, tapped.columns.index(f"{rate}.{candidate.site}")]
        parts.append(torque * speed[:, None] / tapped.rate)
    return np.concatenate(parts)
