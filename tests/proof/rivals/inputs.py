"""Inputs of the methods that learn a discrepancy as a function, and what it means to depend on one of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from proof.answer import Answer, Claim
from proof.rivals.case import Array, Case, Recording, detrended, held_out
from proof.rivals.library import Term, suspect
from proof.rivals.regress import merged
from proof.words import Family, Port

_WORTH = 0.05  # share of a trajectory's variance that a discrepancy must predict, left out of the fit, to be one
_MOST_CHANNELS = 4


@dataclass(frozen=True, slots=True)
class Input:
    """Columns that belong together, and the term that a dependence on them stands for."""

    stands_for: Term
    columns: Callable[[Recording], Array]  # (n, k)


def inputs(case: Case) -> tuple[Input, ...]:
    """What a discrepancy may depend on: phases of rotors, rates, angles, time, loads."""
    return tuple(_inputs(case))


def _inputs(case: Case) -> Iterator[Input]:
    def one(name: str, port: Port, axis: str, family: Family, signal: str, channel: str = "") -> Input:
        def column(recording: Recording) -> Array:
            return recording.signals[signal]

        return Input(Term(name, port, axis, family, column, channel), lambda recording: column(recording)[:, None])

    for joint in case.joints:

        def phase(recording: Recording, joint: str = joint) -> Array:
            angle = recording.signals[f"rotor_angle.{joint}"]
            return np.stack([np.sin(angle), np.cos(angle)], axis=1)

        turn = Term(f"rotor phase {joint}", "motor torque", joint, "motor order", lambda r, p=phase: p(r)[:, 0])
        yield Input(turn, phase)
        yield one(f"rate {joint}", "joint torque", joint, "friction", f"joint_rate.{joint}")
        yield one(f"angle {joint}", "joint torque", joint, "harness", f"joint_angle.{joint}")
    yield one("time", "transducer", "", "drift", "time")
    for channel in case.channels:
        if not channel.startswith("angle."):
            yield one(channel, "transducer", "", "gain", f"wrench.{channel}", channel)


def matrix(chosen: Sequence[Input], recording: Recording) -> tuple[Array, Array]:
    """Columns (n, k) of all inputs, and which input each column is of (k,)."""
    parts = [entry.columns(recording) for entry in chosen]
    return np.concatenate(parts, axis=1), np.repeat(np.arange(len(parts)), [part.shape[1] for part in parts])


@dataclass(frozen=True, slots=True, eq=False)
class Learnt:
    """A learnt discrepancy of one channel."""

    predict: Callable[[Recording], Array]  # (n,)
    relevance: Array  # (inputs,) not negative
    left_out: float  # share of the variance of trajectories left out that it predicts


def channels_worth_learning(case: Case) -> tuple[int, ...]:
    """The channels whose residual stands most above the floor."""
    rms = [
        np.sqrt(np.mean(np.concatenate([detrended(r, r.residual)[:, k] for r in case.fitted]) ** 2))
        for k in range(len(case.channels))
    ]
    return tuple(int(k) for k in np.argsort(rms)[::-1][:_MOST_CHANNELS])


def answer(method: str, case: Case, chosen: Sequence[Input], learnt: Mapping[int, Learnt], seconds: float) -> Answer:
    """Claim what the discrepancies that predict depend on most; the next inputs are alternatives.

    A function learnt has no name: the claim gets the one that a dependence on that input would have, to be fair.
    """
    kept = {channel: found for channel, found in learnt.items() if found.left_out > _WORTH}

    def predicted(recording: Recording) -> Array:
        out = np.zeros_like(recording.residual)
        for channel, found in kept.items():
            out[:, channel] = found.predict(recording)
        return out

    claims = []
    for place, entry in enumerate(chosen):
        energy = {
            case.channels[channel]: float(found.relevance[place] * found.left_out) for channel, found in kept.items()
        }
        if energy and sum(energy.values()) > 0.0:
            told = suspect(entry.stands_for, energy)
            worth = float(max(found.left_out for found in kept.values()))
            claims.append(
                (
                    sum(energy.values()),
                    Claim(
                        port=told.port, axis=told.axis, channels=told.channels, family=told.family,
                        held_out_variance=worth,
                    ),
                )
            )  # fmt: skip
    return Answer(
        method=method,
        trial=case.trial,
        detected=bool(kept),
        verdict="physics" if kept else "parameters off" if case.moved else "none",
        moved=case.moved,
        finds=merged(claims)[:1],
        held_out=held_out(case, predicted),
        seconds=case.seconds + seconds,
    )


def folds(case: Case) -> tuple[tuple[tuple[Recording, ...], tuple[Recording, ...]], ...]:
    """Recordings to learn from and to be predicted: each trajectory in turn is left out, or, of one, each recording."""
    fitted = case.fitted
    trajectories = sorted({recording.trajectory for recording in fitted})
    if len(trajectories) > 1:
        groups = [tuple(r for r in fitted if r.trajectory == one) for one in trajectories]
    else:
        groups = [(recording,) for recording in fitted]
    if len(groups) == 1:
        return ((fitted, fitted),)
    return tuple((tuple(r for r in fitted if r not in group), group) for group in groups)


def explained(recordings: Sequence[Recording], channel: int, predict: Callable[[Recording], Array]) -> float:
    """Share of a channel's variance in `recordings` that `predict` explains, straight lines taken off both."""
    total = left = 0.0
    for recording in recordings:
        y = detrended(recording, recording.residual[:, [channel]])
        total += float(np.sum(y**2))
        left += float(np.sum((y - detrended(recording, predict(recording)[:, None])) ** 2))
    return 1.0 - left / total if total > 0.0 else 0.0
