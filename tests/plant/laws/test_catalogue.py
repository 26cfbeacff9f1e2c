"""Conformance of every effect of the catalogue with what a search relies on, and the laws against closed forms."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from kbs_process.campaign.units import DIMENSIONS
from kbs_process.plant.along import _module, along, signals_of
from kbs_process.plant.effect import Effect, Port, instance, shared
from kbs_process.plant.laws import CATALOGUE, MEASURED, find, select
from kbs_process.signals.records import Array

KNOWN_UNITS = {unit for units in DIMENSIONS.values() for unit in units}
LAWS = (*CATALOGUE, *MEASURED)
SUSPECTS = [e for e in LAWS if any(p.role == "amplitude" for p in e.parameters)]


def amplitudes(effect: Effect) -> list[str]:
    return [entry.name for entry in effect.parameters if entry.role == "amplitude"]


def around(effect: Effect) -> dict[str, float]:
    """Signals of a drive that turns, of a point or of a plate that moves; shapes in the middle of their priors."""
    signals = {
        "field": 3.02, "field_travel": 0.7, "field_rate": 0.4,
        "rotor_angle": 3.0, "rotor_rate": 0.5, "rotor_travel": 0.0, "ratio": 100.0,
        "joint_angle": 0.0291, "joint_rate": 0.004, "time": 2.5,
        "other_angle": 0.3, "other_rate": 0.004,
        "x": 0.1, "y": -0.2, "z": 0.4, "vx": 0.01, "vy": 0.02, "vz": -0.01,
        "base_x": 1e-3, "base_y": -4e-4, "base_z": 2e-4,
        "base_rate_x": 1e-5, "base_rate_y": -2e-5, "base_rate_z": 1e-5,
    }  # fmt: skip
    shapes = {entry.name: entry.prior.middle for entry in effect.parameters if entry.role != "amplitude"}
    return signals | {state.name: 0.3 for state in effect.states} | shapes


def value(effect: Effect, values: dict[str, float], **given: float) -> Array:
    return np.ravel(effect.equation(*((values | given)[name] for name in effect.arguments)))


@pytest.mark.parametrize("effect", SUSPECTS, ids=lambda effect: effect.name)
class TestSuspects:
    def test_is_absent_without_amplitude_and_linear_in_it(self, effect: Effect) -> None:
        names, values = amplitudes(effect), around(effect)
        size = effect.port.components
        none = value(effect, values, **dict.fromkeys(names, 0.0))
        assert not none[:size].any()
        units = [value(effect, values, **dict.fromkeys(names, 0.0) | {name: 1.0}) for name in names]
        weights = np.random.default_rng(11).uniform(0.1, 2.0, len(names))
        mixed = value(effect, values, **dict(zip(names, weights, strict=True)))
        expected = np.tensordot(weights, np.stack(units), axes=1)[:size]
        np.testing.assert_allclose(mixed[:size], expected, rtol=1e-12, atol=1e-15)
        # States are integrated once for all amplitudes.
        np.testing.assert_array_equal(mixed[size:], none[size:])

    def test_parameters_can_be_searched(self, effect: Effect) -> None:
        for entry in effect.parameters:
            low, high = entry.bounds
            assert entry.unit in KNOWN_UNITS, entry.name
            assert low < high
            if entry.role == "amplitude":
                assert low <= 0.0 < high
                assert not entry.grid
                assert 0.0 < entry.prior.spread < high
            if not entry.over or entry.over.endswith(".turns"):
                assert all(low <= point <= high for point in entry.grid)
            elif entry.over != "spectrum":
                assert entry.grid
                assert all(0.0 <= share <= 1.0 for share in entry.grid)
            if entry.role == "shared":
                owner = [e for e in CATALOGUE if replace(entry, role="shape") in e.parameters]
                assert [e.name for e in owner][:1] in (["synchronous_motor"], ["flexspline"])

    @pytest.mark.slow
    def test_compiled_along_signals_it_is_the_equation(self, effect: Effect) -> None:
        """One interval in one part: the equation at its middle, rates the slopes, states after half their step."""
        dt, values = 1e-3, around(effect)
        travel = {"field": 5e-4, "rotor_angle": 5e-4, "joint_angle": 4e-6, "other_angle": 4e-6, "time": dt}
        travel |= {"x": 1e-5, "y": 2e-5, "z": -1e-5, "base_x": 1e-8, "base_y": -2e-8, "base_z": 1e-8}
        base = signals_of(effect)
        columns = np.array([[values[name] + k * travel[name] for name in base] for k in range(2)])
        given = [entry.name for entry in effect.parameters if entry.role != "amplitude"]
        given += ["ratio"] * ("ratio" in effect.arguments)
        names = amplitudes(effect)
        out = np.zeros((2, len(names), effect.port.components))
        _module(effect)(columns, np.array([values[name] for name in given]), dt, 1, out)
        middle = values | {name: values[name] + 0.5 * travel[name] for name in base} | {"rotor_travel": 5e-4}
        middle |= {"rotor_rate": 0.5, "joint_rate": 4e-3, "other_rate": 4e-3, "vx": 0.01, "vy": 0.02, "vz": -0.01}
        middle |= {"field_rate": 0.5, "field_travel": 2.5e-4}
        start = {state.name: state.initial for state in effect.states}
        zero = dict.fromkeys(names, 0.0)
        rates = value(effect, middle | start, **zero)[effect.port.components :]
        half = {s.name: s.initial + 0.5 * dt * rate for s, rate in zip(effect.states, rates, strict=True)}
        for index, name in enumerate(names):
            expected = value(effect, middle | half, **zero | {name: 1.0})[: out.shape[2]]
            if effect.port is Port.MOTOR_FRICTION:
                expected = -expected
            scale = np.abs(expected).max()
            # Runge and Kutta's step differs from Euler's by the square of the state's rate times dt.
            near = 0.05 if effect.states else 1e-9
            np.testing.assert_allclose(out[0, index], expected, rtol=near, atol=near * scale + 1e-15)


def test_names_of_parameters_belong_to_one_effect() -> None:
    own = [p.name for e in LAWS for p in e.parameters if p.role != "shared"]
    own += [state.name for e in LAWS for state in e.states]
    assert sorted(own) == sorted(set(own))


def test_a_second_action_has_names_of_its_own_and_the_same_law() -> None:
    first, second = select(["kinematic_error_2", "kinematic_error"])
    assert (first.name, second.name) == ("kinematic_error", "kinematic_error_2")
    assert second == instance(first, 2)
    assert {"kinematic_sin_2", "kinematic_order_2", "Ka", "fsv"} <= set(second.arguments)
    values = around(first) | {"kinematic_sin": 1e-4, "kinematic_cos": 0.0}
    renamed = values | {name + "_2": values[name] for name in ("kinematic_sin", "kinematic_cos", "kinematic_order")}
    assert value(first, values) == value(second, renamed)
    assert find("kinematic_error_1") is None
    assert find("nothing_2") is None
    assert shared(find("flexspline"), "Ka").role == "shared"  # type: ignore[arg-type]


DT = 0.01
T = np.arange(3000) * DT
RATE = 0.02 * np.sin(2.0 * np.pi * T / 15.0)
ANGLE = 0.02 * 15.0 / (2.0 * np.pi) * (1.0 - np.cos(2.0 * np.pi * T / 15.0))


def shape(effect: Effect, **given: float) -> dict[str, float]:
    return around(effect) | given


def test_orders_that_the_samples_cannot_show_average_out() -> None:
    """A tone of 130 Hz sampled at 100 Hz would show at 30 Hz; its mean over an interval is 0.2 of it."""
    order, turn = find("motor_order"), 2.0 * np.pi * 1.3 * T
    assert order is not None
    out = along(order, {"rotor_angle": turn}, {"order": 100.0}, DT)[:-1, 0, 0]
    phase = 2.0 * np.pi * 130.0 * T[:-1]
    mean = (np.cos(phase) - np.cos(phase + 2.0 * np.pi * 1.3)) / (2.0 * np.pi * 1.3)
    np.testing.assert_allclose(out, mean, atol=0.02)
    assert 0.15 < np.abs(out).max() < 0.25


def test_dahl_along_a_motion_is_its_closed_form() -> None:
    dahl = find("dahl")
    assert dahl is not None
    out = along(dahl, {"joint_angle": ANGLE}, {"dahl_displacement": 1e-3}, DT)[:, 0, 0]
    until = T < 7.4  # the first reversal is at 7.5 s
    expected = -(1.0 - np.exp(-ANGLE / 1e-3))
    np.testing.assert_allclose(out[until], expected[until], atol=0.02)
    assert out[T > 10.0][0] > 0.99  # turned about


def test_hysteresis_gives_a_loop_and_takes_energy() -> None:
    for name, tag in (("harness", "harness"), ("ground_cable", "cable")):
        effect = find(name)
        assert effect is not None
        given = {f"{tag}_memory": 0.02, f"{tag}_middle": 0.05, f"{tag}_reach": 0.1}
        *elastic, friction = along(effect, {"joint_angle": ANGLE}, given, DT)[:, :, 0].T
        moved = np.diff(ANGLE, append=ANGLE[-1])
        for spring in elastic:  # offset, slope, curves
            assert spring @ moved == pytest.approx(0.0, abs=1e-4)
        assert friction @ moved < -0.5 * 2.0 * np.ptp(ANGLE)


def test_joint_hysteresis_is_elastic_after_a_reversal_and_a_single_stop_if_sharp() -> None:
    effect = find("joint_hysteresis")
    assert effect is not None
    soft, sharp = (
        along(effect, {"joint_angle": ANGLE}, {"slip_angle": 0.02, "slip_power": n}, DT)[:, 0, 0] for n in (1.0, 5.0)
    )
    until = T < 7.4  # the first reversal is at 7.5 s
    np.testing.assert_allclose(soft[until], -(1.0 - np.exp(-ANGLE[until] / 0.02)), atol=2e-3)
    # n = 1 never quite yields, and unloads at the slope that it began with, as a spring does.
    turned, angle = (T > 7.6) & (T < 9.0), ANGLE.max()
    np.testing.assert_allclose(soft[turned] - soft[T <= 7.5][-1], (angle - ANGLE[turned]) / 0.02, atol=4e-3)
    stop = np.clip(ANGLE / 0.02, 0.0, 1.0)
    assert np.abs(sharp[until] + stop[until]).max() < 0.2
    assert np.abs(sharp[until] + stop[until]).max() < 0.6 * np.abs(soft[until] + stop[until]).max()
    for torque in (soft, sharp):
        assert torque @ np.diff(ANGLE, append=ANGLE[-1]) < 0.0


def test_appendage_is_an_inertia_below_its_frequency_and_rings_at_it() -> None:
    effect = find("appendage")
    assert effect is not None
    given = {"sway_frequency": 5.0, "sway_damping": 0.02}
    slow = along(effect, {"joint_angle": ANGLE}, given, DT)[:, 0, 0]
    acceleration = 0.02 * 2.0 * np.pi / 15.0 * np.cos(2.0 * np.pi * T / 15.0)
    late = T > 8.0
    np.testing.assert_allclose(slow[late], -acceleration[late], atol=0.05 * np.abs(acceleration).max())
    kick = np.where(T > 1.0, 1e-3 * (T - 1.0), 0.0)
    spectrum = np.abs(np.fft.rfft(along(effect, {"joint_angle": kick}, given, DT)[:, 0, 0]))
    assert np.fft.rfftfreq(len(T), DT)[spectrum.argmax()] == pytest.approx(5.0, abs=0.1)


def test_friction_along_signals_opposes_the_rotor() -> None:
    effect = find("tooth_stiction")
    assert effect is not None
    out = along(effect, {"rotor_angle": 100.0 * ANGLE}, {"delta": 0.5, "phi_stat": 0.0}, DT)[:, 0, 0]
    assert (out[np.abs(RATE) > 1e-3] * RATE[np.abs(RATE) > 1e-3] <= 1e-12).all()
    # Contact over 2 delta of each 2 pi.
    assert np.abs(out[np.abs(RATE) > 5e-3]).mean() == pytest.approx(0.5 / math.pi, abs=0.02)
