"""The terms that regressions choose from: what a test engineer would try, with the physics that each stands for.

Signals of a recording, all (n,) at the working rate: `time`, and for each joint `rotor_angle.J`, `rotor_rate.J`,
`joint_angle.J`, `joint_rate.J`; `wrench.CH`, the predicted wrench.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from proof.answer import Suspect
from proof.rivals.case import Array, Case, Recording
from proof.words import Family, Port

_STICTION = 3.5e-4  # rad/s: 0.02 deg/s, over which friction changes its sign
_PLAY = 0.035  # rad: 2 deg of memory
_COGGING = 200.0  # a motor turn
_ORDERS = (1.0, 2.0, 4.0)
_WARM = 60.0  # s

Evaluate = Callable[[Recording], Array]


@dataclass(frozen=True, slots=True)
class Term:
    """A function of the signals, and what it would mean if the residual followed it."""

    name: str
    port: Port
    axis: str
    family: Family
    evaluate: Evaluate
    channel: str = ""  # for terms of the transducer: the channel that acts

    @property
    def group(self) -> tuple[str, str, str, str]:
        """Terms of one group are chosen together: sine and cosine, powers."""
        return self.port, self.axis, self.family, self.channel


def library(case: Case) -> tuple[Term, ...]:
    """All terms for a case."""
    terms: list[Term] = []
    for joint in case.joints:
        terms += _drive(joint, case.recordings[0].dt, case)
    terms += [
        Term("t^2", "transducer", "", "drift", lambda r: r.signals["time"] ** 2),
        Term(f"exp(-t/{_WARM:g} s)", "transducer", "", "drift", lambda r: np.exp(-r.signals["time"] / _WARM)),
    ]
    for channel in case.channels:
        if not channel.startswith("angle."):
            terms += _sensing(channel)
    return tuple(terms)


def matrix(terms: tuple[Term, ...], recording: Recording) -> Array:
    """Columns (n, terms)."""
    return np.stack([term.evaluate(recording) for term in terms], axis=1)


def _drive(joint: str, dt: float, case: Case) -> Iterator[Term]:
    def on(signal: str, function: Callable[[Array], Array]) -> Evaluate:
        return lambda r: function(r.signals[f"{signal}.{joint}"])

    for order in _ORDERS:
        for name, wave in (("sin", np.sin), ("cos", np.cos)):
            yield Term(
                f"{name}({order:g} th_r.{joint})", "motor torque", joint, "motor order",
                on("rotor_angle", lambda a, order=order, wave=wave: wave(order * a)),
            )  # fmt: skip
    if any(np.any(_slow_enough(r, joint, dt)) for r in case.recordings):
        for name, wave in (("sin", np.sin), ("cos", np.cos)):
            yield Term(
                f"{name}(200 th_r.{joint})", "motor torque", joint, "cogging",
                lambda r, wave=wave: wave(_COGGING * r.signals[f"rotor_angle.{joint}"]) * _slow_enough(r, joint, dt),
            )  # fmt: skip
    yield Term(f"sign(w.{joint})", "joint torque", joint, "friction", on("joint_rate", _sign))
    yield Term(f"w.{joint}", "joint torque", joint, "viscous", on("joint_rate", _same))
    yield Term(f"w|w|.{joint}", "external wrench", "el", "air drag", on("joint_rate", lambda w: w * np.abs(w)))
    yield Term(
        f"sign(w.{joint}) exp(-t/{_WARM:g} s)", "joint torque", joint, "warm-up",
        lambda r: _sign(r.signals[f"joint_rate.{joint}"]) * np.exp(-r.signals["time"] / _WARM),
    )  # fmt: skip
    for power in (1, 2, 3):
        yield Term(f"q^{power}.{joint}", "joint torque", joint, "harness", on("joint_angle", lambda q, p=power: q**p))
    yield Term(f"play(q.{joint})", "transmission", joint, "hysteresis", on("joint_angle", _play))
    for name, wave in (("sin", np.sin), ("cos", np.cos)):
        yield Term(f"{name}(q.{joint})", "mass properties", joint, "mass", on("joint_angle", wave))
        yield Term(
            f"{name}(2 q.{joint})", "external wrench", joint, "cable", on("joint_angle", lambda q, f=wave: f(2.0 * q))
        )  # fmt: skip
    yield Term(
        f"dw/dt.{joint}", "mass properties", joint, "mass",
        lambda r: np.gradient(r.signals[f"joint_rate.{joint}"], r.dt),
    )  # fmt: skip


def _sensing(channel: str) -> Iterator[Term]:
    def of(function: Callable[[Array, float], Array]) -> Evaluate:
        return lambda r: function(r.signals[f"wrench.{channel}"], r.dt)

    yield Term(channel, "transducer", "", "gain", of(lambda w, dt: w), channel)
    for power in (2, 3):
        yield Term(
            f"{channel}^{power}", "transducer", "", "non-linearity",
            of(lambda w, dt, p=power: (w - w.mean()) ** p), channel,
        )  # fmt: skip
    yield Term(f"d{channel}/dt", "clock", "wrench", "offset", of(np.gradient), channel)


def _same(x: Array) -> Array:
    return x


def _sign(w: Array) -> Array:
    return np.tanh(w / _STICTION)


def _play(q: Array) -> Array:
    """The play operator: follows q once it has moved by `_PLAY`."""
    out = np.empty_like(q)
    held = q[0]
    for k, value in enumerate(q):
        held = min(max(held, value - _PLAY), value + _PLAY)
        out[k] = held
    return out


def _slow_enough(recording: Recording, joint: str, dt: float) -> Array:
    """1 where the cogging line lies below 0.4 of the working rate, 0 elsewhere."""
    line = _COGGING * np.abs(recording.signals[f"rotor_rate.{joint}"]) / (2.0 * np.pi)
    return (line < 0.4 / dt).astype(float)


def suspect(term: Term, energy: Mapping[str, float]) -> Suspect:
    """The place and physics that a term stands for, by the channels in which it explains most.

    A function of a joint's angle that only its encoder follows is the encoder's own; of a load that acts on one channel
    and is read in another, cross-coupling; a rate that only an encoder follows, its clock.
    """
    ranked = sorted(energy, key=lambda channel: -energy[channel])
    most, share = ranked[0], energy[ranked[0]] / max(sum(energy.values()), 1e-300)
    read = tuple(channel for channel in ranked if energy[channel] > 0.1 * energy[most])
    if most.startswith("angle.") and share > 0.9:
        joint = most.removeprefix("angle.")
        if term.family in ("mass", "cable", "harness"):
            return Suspect(port="encoder", axis=joint, channels=(most,), family="eccentricity")
        if term.family == "viscous":
            return Suspect(port="clock", axis="encoder", channels=(most,), family="offset")
    if term.port == "transducer":
        wrench = tuple(channel for channel in read if not channel.startswith("angle.")) or (term.channel,)
        crossed = term.family == "gain" and wrench[0] != term.channel
        return Suspect(port="transducer", channels=wrench, family="cross-coupling" if crossed else term.family)
    return Suspect(port=term.port, axis=term.axis, channels=read, family=term.family)
