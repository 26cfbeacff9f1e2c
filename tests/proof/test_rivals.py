"""Each rival finds what it can find, in a made-up residual whose law is known, and nothing in white noise."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from proof.answer import Answer
from proof.rivals import boosting, gaussian, greybox, parameters, sparse
from proof.rivals.case import Array, Case, Recording
from proof.rivals.library import library, suspect

pytestmark = pytest.mark.slow

CHANNELS = ("Fz", "Tx", "Tz", "angle.az")
DT, SAMPLES = 0.2, 300
Law = Callable[[dict[str, Array]], Array]  # signals -> (n, channels), in units of the floor


def case(law: Law | None) -> Case:
    """Two trajectories to fit, each run twice, and another held out; white noise, and the law."""
    recordings = []
    for index, (trajectory, held_out) in enumerate(((0, False), (0, False), (1, False), (1, False), (2, True))):
        t = np.arange(SAMPLES) * DT
        generator = np.random.default_rng(100 * trajectory + index)
        signals = {"time": t}
        for joint, rate, phase in (("az", 0.4, 0.3), ("el", 0.3, 1.1)):
            w = np.deg2rad(1.0) * np.sin((1.0 + 0.3 * trajectory) * rate * t + phase)
            q = np.cumsum(w) * DT + 0.2 * trajectory
            signals |= {f"joint_angle.{joint}": q, f"joint_rate.{joint}": w}
            signals |= {f"rotor_angle.{joint}": 100.0 * q, f"rotor_rate.{joint}": 100.0 * w}
        load = np.cos(signals["joint_angle.el"])
        for k, channel in enumerate(CHANNELS[:3]):
            signals[f"wrench.{channel}"] = 10.0 * load * np.cos(k + signals["joint_angle.az"])
        residual = generator.standard_normal((len(t), len(CHANNELS)))
        if law is not None:
            residual += law(signals)
        recordings.append(
            Recording(
                name=f"R{index}", held_out=held_out, trajectory=trajectory, dt=DT, valid=t > 1.0,
                residual=residual, signals=signals, whiten=lambda x: x.ravel(),
            )
        )  # fmt: skip
    return Case("T", CHANNELS, ("az", "el"), tuple(recordings), (), -0.3, 5.0)


def friction(signals: dict[str, Array]) -> Array:
    out = np.zeros((SAMPLES, len(CHANNELS)))
    out[:, 2] = 2.0 * np.sign(signals["joint_rate.az"])
    out[:, 3] = 1.5 * np.sign(signals["joint_rate.az"])
    return out


def drift(signals: dict[str, Array]) -> Array:
    out = np.zeros((SAMPLES, len(CHANNELS)))
    out[:, 1] = 25.0 * (signals["time"] / 60.0) ** 2
    return out


def top(answer: Answer) -> tuple[str, str, str]:
    first = answer.finds[0]
    return first.port, first.axis, first.family


REGRESSIONS = pytest.mark.parametrize("method", [sparse, greybox])
LEARNERS = pytest.mark.parametrize("method", [gaussian, boosting])


@pytest.fixture(autouse=True)
def less_effort(monkeypatch: pytest.MonkeyPatch) -> None:
    """What a strong and simple law needs."""
    monkeypatch.setattr(gaussian, "_SAMPLES", 100)
    monkeypatch.setattr(boosting, "_TREES", 40)
    monkeypatch.setattr(sparse, "_THRESHOLDS", (0.1, 0.5))
    monkeypatch.setattr(sparse, "_MODELS", 6)


@REGRESSIONS
def test_regressions_find_friction_and_its_joint(method: object) -> None:
    answer = method.solve(case(friction))  # type: ignore[attr-defined]
    assert top(answer) == ("joint torque", "az", "friction")
    assert answer.held_out is not None and answer.held_out.after < 1.1 < answer.held_out.before


@REGRESSIONS
def test_regressions_find_a_drift_and_its_channel(method: object) -> None:
    answer = method.solve(case(drift))  # type: ignore[attr-defined]
    assert top(answer) == ("transducer", "", "drift") and answer.finds[0].channels == ("Tx",)


@LEARNERS
def test_learners_say_which_signal_matters(method: object) -> None:
    answer = method.solve(case(friction))  # type: ignore[attr-defined]
    assert top(answer) == ("joint torque", "az", "friction")
    assert answer.held_out is not None and answer.held_out.after < 0.9 * answer.held_out.before


@LEARNERS
def test_learners_find_nothing_in_noise(method: object) -> None:
    answer = method.solve(case(None))  # type: ignore[attr-defined]
    assert answer.finds == () and not answer.detected


def test_grey_box_finds_nothing_in_white_noise() -> None:
    answer = greybox.solve(case(None))
    assert answer.finds == () and answer.log10_p is not None and answer.log10_p > -3.0


def test_a_refit_says_that_there_is_a_mismatch_and_not_what() -> None:
    answer = parameters.solve(replace(case(friction), log10_p=-50.0))
    assert answer.detected and answer.verdict == "undecided" and not answer.finds
    assert answer.held_out is not None and answer.held_out.before == answer.held_out.after > 1.1


def test_terms_mean_what_their_channels_say() -> None:
    terms = {term.name: term for term in library(case(None))}
    only_encoder = {"angle.el": 10.0, "Tx": 0.1}
    assert suspect(terms["sin(q.el)"], only_encoder).family == "eccentricity"
    assert suspect(terms["sin(q.el)"], {"Tx": 5.0, "Ty": 4.0}).family == "mass"
    assert suspect(terms["Fz"], {"Tx": 5.0}).family == "cross-coupling"
    assert suspect(terms["Fz"], {"Fz": 5.0}).family == "gain"
