"""Conformance of every effect of the catalogue, and errors of wiring when an effect is declared."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kbs_process.campaign.units import DIMENSIONS
from kbs_process.errors import ConfigError
from kbs_process.plant.effect import Effect, Law, LogNormal, Parameter, Port, State
from kbs_process.plant.laws import CATALOGUE, MEASURED, SENSING, select
from kbs_process.plant.laws.friction.stiction import limit as tooth_stiction
from kbs_process.plant.laws.position.detent import torque as detent

UNITS = {unit for units in DIMENSIONS.values() for unit in units}


@pytest.mark.parametrize("effect", (*CATALOGUE, *MEASURED), ids=lambda effect: effect.name)
class TestCatalogue:
    def test_declaration(self, effect: Effect) -> None:
        assert effect.reference
        for parameter in effect.parameters:
            assert parameter.unit in UNITS
            assert parameter.description
            low, high = parameter.bounds
            assert low <= parameter.prior.middle <= high

    def test_docstring_says_what_a_reviewer_asks(self, effect: Effect) -> None:
        text = effect.equation.__doc__ or ""
        for heading in ("Equation:", "Units:", "Validity:", "Source:"):
            assert heading in text

    def test_states_have_units(self, effect: Effect) -> None:
        assert all(state.unit in UNITS and math.isfinite(state.initial) for state in effect.states)

    @given(data=st.data())
    def test_finite_and_passive_where_claimed(self, effect: Effect, data: st.DataObject) -> None:
        near = st.floats(-1e3, 1e3)
        values = {name: data.draw(near, name) for name in effect.arguments if name in effect.port.signals}
        values |= {state.name: data.draw(near, state.name) for state in effect.states}
        values |= {entry.name: entry.prior.middle or entry.prior.spread for entry in effect.parameters}
        if "ratio" in values:
            values["ratio"] = 100.0
        result = effect.equation(*(values[name] for name in effect.arguments))
        torque = result[0] if effect.states else result
        assert np.isfinite(result).all()
        if effect.port is Port.MOTOR_FRICTION:
            assert torque >= 0.0  # the plant opposes motion with it
        elif effect.passive and effect.port is Port.EXTERNAL_FORCE:
            assert result @ np.array([values[name] for name in ("vx", "vy", "vz")]) <= 0.0
        elif effect.passive:
            rate = "rotor_rate" if effect.port is Port.MOTOR_TORQUE else "joint_rate"
            assert torque * values[rate] <= 0.0


def test_names_are_unique_and_ordered_as_summed() -> None:
    names = [effect.name for effect in (*CATALOGUE, *MEASURED)]
    assert len(set(names)) == len(names)
    assert [effect.name for effect in select(names[::-1])] == names


@pytest.mark.parametrize("laws", [CATALOGUE, MEASURED, SENSING], ids=["effects", "measured", "sensing"])
def test_no_two_laws_declare_the_same_order(laws: tuple[Law, ...]) -> None:
    orders = [law.order for law in laws]
    assert len(set(orders)) == len(orders)


def test_unknown_effect_is_answered_with_the_closest() -> None:
    with pytest.raises(ConfigError, match="did you mean 'cogging'"):
        select(["coging"])


def linear(rotor_rate: float, b: float) -> float:
    return -b * rotor_rate


def misspelt(rotor_rat: float, b: float) -> float:
    return -b * rotor_rat


def untyped(rotor_rate, b: float) -> float:  # type: ignore[no-untyped-def]
    return -b * rotor_rate


def leaky(z: float, b: float) -> float:
    return -b * z


B = Parameter("b", "N m s/rad", LogNormal(1.0, 0.1), "damping", (0.0, 10.0))
SPARE = Parameter("c", "N m", LogNormal(1.0, 0.1), "unused", (0.0, 10.0))
CLASH = Parameter("rotor_rate", "rad/s", LogNormal(1.0, 0.1), "a signal's name", (0.0, 10.0))
Z = State("z", "N m", 0.0, "memory")


@pytest.mark.parametrize(
    ("equation", "parameters", "states", "message"),
    [
        (misspelt, (B,), (), "rotor_rat"),
        (linear, (B, SPARE), (), "not an argument"),
        (linear, (B, CLASH), (), "twice, or named like a signal"),
        (untyped, (B,), (), "not float"),
        (leaky, (B,), (Z,), "the result is not"),
    ],
)
def test_wrong_wiring_is_an_error_at_import(equation, parameters, states, message) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(TypeError, match=message):
        Effect("trial", Port.MOTOR_TORQUE, equation, parameters, states=states)


def test_tooth_stiction_over_a_travel_is_the_mean_of_that_at_instants() -> None:
    rng = np.random.default_rng(7)
    for angle, travel, delta, phase in zip(
        rng.uniform(-3.0, 3.0, 200),
        rng.choice([1e-4, 3e-3, 0.02, -0.05], 200),
        rng.uniform(0.05, 3.1, 200),
        rng.uniform(-3.0, 3.0, 200),
        strict=True,
    ):
        within = angle + travel * (np.arange(4000) / 4000.0 - 0.5 + 0.5 / 4000.0)
        mean = np.mean([tooth_stiction(x, 0.0, 1.0, delta, phase) for x in within])
        assert tooth_stiction(angle, travel, 1.0, delta, phase) == pytest.approx(mean, abs=2e-3)


@pytest.mark.parametrize("name", ["floor_tilt", "friction_warmup"])
def test_what_settles_has_not_begun_before_a_recording_does(name: str) -> None:
    """A start in motion is led into from negative times, where a decay would grow without bounds."""
    effect = next(one for one in CATALOGUE if one.name == name)
    known = dict.fromkeys(effect.arguments, 1.0) | {entry.name: 0.5 for entry in effect.parameters}
    assert effect.value({**known, "time": -20.0}) == effect.value({**known, "time": 0.0})
    assert effect.value({**known, "time": 2.0}) != effect.value({**known, "time": 0.0})


def test_friction_that_warms_up_is_dry_and_viscous_and_opposes_the_motion() -> None:
    (effect,) = select(["friction_warmup"])
    known = {"warmup": 0.5, "warmup_dry": 0.2, "warmup_time": 40.0, "warmup_rate": 0.1}

    def torque(rate: float, time: float) -> float:
        return float(effect.value({**known, "rotor_rate": rate, "time": time})[0])

    assert torque(0.05, 0.0) == pytest.approx(-(0.5 * 0.05 + 0.2 * 0.5))
    assert torque(0.3, 0.0) == pytest.approx(-(0.5 * 0.3 + 0.2))
    assert torque(-0.3, 0.0) == -torque(0.3, 0.0)
    assert torque(0.3, 40.0) == pytest.approx(torque(0.3, 0.0) / np.e)
    assert torque(0.0, 0.0) == 0.0


@pytest.mark.parametrize("size", [0.7, -0.7])
def test_a_detent_takes_no_work_in_a_pass_and_is_the_slope_of_its_potential(size: float) -> None:
    angle = np.linspace(-0.3, 0.5, 4001)
    torque = np.array([detent(q, size, 0.1, 0.03) for q in angle])
    work = 0.5 * np.cumsum((torque[1:] + torque[:-1]) * np.diff(angle))
    assert abs(work[-1]) < 1e-9 * abs(size)
    potential = -size * 0.03 * np.exp(0.5 - 0.5 * ((angle[1:] - 0.1) / 0.03) ** 2)
    np.testing.assert_allclose(work, potential[0] - potential, atol=1e-4 * abs(size) * 0.03)
    assert np.abs(torque).max() == pytest.approx(abs(size), rel=1e-5)
    assert angle[np.argmax(torque)] == pytest.approx(0.1 - np.sign(size) * 0.03, abs=3e-4)


def test_a_second_delay_has_its_own_number() -> None:
    (late,) = select(["controller_latency_2"])
    assert late.delay in {entry.name for entry in late.parameters}
