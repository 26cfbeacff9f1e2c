"""Conformance of every sensing effect, and the laws against closed forms."""

from __future__ import annotations

import inspect

import numpy as np
import pytest

from kbs_process.plant.effect import Normal, Parameter
from kbs_process.plant.laws import SENSING
from kbs_process.plant.sensing import READINGS, Sensing, SensingPort
from kbs_process.signals.records import Array

T = np.arange(2000) * 0.05
READING = 3.0 * np.sin(2.0 * np.pi * T / 40.0) + 0.2 * T
KNOWN: dict[str, Array | float] = {
    "reading": READING,
    "acting": 10.0 + np.cos(T),
    "rate": 3.0 * 2.0 * np.pi / 40.0 * np.cos(2.0 * np.pi * T / 40.0) + 0.2,
    "time": T,
    "temperature": 20.0 + 0.01 * T,
    "code": 2.0 * np.pi / 2**14,
    "drop_time": 60.0,
}


def changed(effect: Sensing, **given: float) -> Array:
    shapes = {entry.name: entry.prior.middle for entry in effect.parameters if entry.role == "shape"}
    return effect.equation(**{name: (KNOWN | shapes | given)[name] for name in effect.arguments})


def law(name: str) -> Sensing:
    return next(effect for effect in SENSING if effect.name == name)


@pytest.mark.parametrize("effect", SENSING, ids=lambda effect: effect.name)
class TestSensing:
    def test_declaration(self, effect: Sensing) -> None:
        text = inspect.getdoc(effect.equation) or ""
        assert all(heading in text for heading in ("Equation:", "Units:", "Validity:", "Source:"))
        assert effect.reference
        by_others = effect.port in (SensingPort.COUPLING, SensingPort.PRODUCT)
        assert by_others == ("acting" in effect.arguments)
        assert "code" not in effect.arguments or effect.port is SensingPort.ENCODER
        for entry in effect.parameters:
            low, high = entry.bounds
            assert entry.description
            assert low <= entry.prior.middle <= high
            if entry.role == "amplitude":
                assert 0.0 < entry.prior.spread < high
            elif not entry.over:
                assert all(low <= point <= high for point in entry.grid)

    def test_is_absent_without_amplitude_and_linear_in_it(self, effect: Sensing) -> None:
        names = [entry.name for entry in effect.parameters if entry.role == "amplitude"]
        zero = dict.fromkeys(names, 0.0)
        assert not changed(effect, **zero).any()
        units = [changed(effect, **zero | {name: 1.0}) for name in names]
        weights = np.linspace(0.3, -1.7, len(names))
        mixed = changed(effect, **dict(zip(names, weights, strict=True)))
        assert mixed.shape == T.shape and np.isfinite(mixed).all()
        np.testing.assert_allclose(mixed, np.tensordot(weights, units, axes=1), rtol=1e-12, atol=1e-12)
        assert all(unit.any() for unit in units)

    def test_leaves_what_it_is_given(self, effect: Sensing) -> None:
        kept = {name: np.copy(KNOWN[name]) for name in READINGS}
        changed(effect, **{entry.name: 1.0 for entry in effect.parameters if entry.role == "amplitude"})
        for name, values in kept.items():
            np.testing.assert_array_equal(KNOWN[name], values)


def test_names_belong_to_one_effect() -> None:
    names = [entry.name for effect in SENSING for entry in effect.parameters]
    assert sorted(names) == sorted(set(names))


def test_lag_is_a_first_order_low_pass() -> None:
    late = READING + changed(law("channel_lag"), lag_share=1.0, lag_time=2.0)
    slope = np.gradient(late, T)
    np.testing.assert_allclose(2.0 * slope[5:-5], (READING - late)[5:-5], atol=5e-3)


def test_hysteresis_depends_on_the_way_and_not_on_time() -> None:
    effect = law("channel_hysteresis")
    loop = changed(effect, loop=1.0, loop_memory=0.2)
    slower = np.interp(np.arange(4000) / 2.0, np.arange(2000), READING)
    again = effect.equation(reading=slower, loop=1.0, loop_memory=0.2)
    np.testing.assert_allclose(again[::2], loop, atol=1e-3)
    assert loop.min() < -0.99 and loop.max() > 0.99


def test_a_channel_steps_where_its_load_passes() -> None:
    step = changed(law("channel_step"), jump=0.5, jump_load=0.3, jump_width=0.01)
    np.testing.assert_allclose(step[READING > 0.35], 0.5, atol=1e-4)
    np.testing.assert_allclose(step[READING < 0.25], 0.0, atol=1e-4)
    there = law("channel_step").equation(reading=np.array([0.3]), jump=0.5, jump_load=0.3, jump_width=0.01)
    np.testing.assert_allclose(there, 0.25, rtol=1e-12)


def test_a_profile_repeats_has_no_mean_and_takes_smooth_curves() -> None:
    profile, nodes = law("encoder_profile").equation, [f"profile_{k}" for k in range(1, 16)]
    rng = np.random.default_rng(5)
    given = dict(zip(nodes, rng.standard_normal(15).tolist(), strict=True)) | {"profile_period": 0.3}
    angle = rng.uniform(-2.0, 2.0, 300)
    np.testing.assert_allclose(profile(reading=angle, **given), profile(reading=angle + 7 * 0.3, **given), atol=1e-12)
    # Between its nodes a cubic spline of a sine is as near as h^4 / 384 of its fourth derivative.
    fine = np.linspace(0.0, 0.3, 400, endpoint=False)
    assert abs(np.mean(profile(reading=fine, **given))) < 1e-12
    columns = np.stack(
        [profile(reading=fine, **(dict.fromkeys(nodes, 0.0) | {n: 1.0, "profile_period": 0.3})) for n in nodes], axis=1
    )
    wave = np.sin(2.0 * np.pi * fine / 0.3)
    left = wave - columns @ np.linalg.lstsq(columns, wave, rcond=None)[0]
    assert np.abs(left).max() < (2.0 * np.pi / 16.0) ** 4 / 384.0


def test_an_s_shaped_channel_has_another_gain_about_one_load_and_is_odd_there() -> None:
    shape, ends = law("channel_s_shape").equation, np.array([-1e9, 1e9])
    given = {"swing": 0.5, "swing_load": 0.3, "swing_width": 0.2}
    np.testing.assert_allclose(shape(reading=0.3 + ends, **given), [-0.5, 0.5], rtol=1e-6)
    np.testing.assert_allclose(shape(reading=np.array([0.1]), **given), -shape(reading=np.array([0.5]), **given))
    slope = np.diff(shape(reading=np.array([0.3 - 1e-6, 0.3 + 1e-6]), **given)) / 2e-6
    np.testing.assert_allclose(slope, 0.5 / 0.2, rtol=1e-6)


def rounded(codes: float) -> Array:
    step = codes * float(np.asarray(KNOWN["code"]))
    return np.rint(READING / step) * step


def test_a_coarse_encoder_reads_whole_coarse_codes() -> None:
    coarse = rounded(1.0) + changed(law("encoder_quantisation"), coarse_share=1.0, coarse_codes=8.0)
    np.testing.assert_allclose(coarse, rounded(8.0), atol=1e-9)


@pytest.mark.parametrize("codes", [1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 8.0, 16.0])
def test_an_encoder_that_is_as_declared_is_no_coarse_one(codes: float) -> None:
    left = rounded(1.0) - READING
    column = changed(law("encoder_quantisation"), coarse_share=1.0, coarse_codes=codes)
    share = float(left @ column / (column @ column))
    taken = share**2 * float(column @ column) / float(left @ left)
    assert share < 0.0 or taken < 0.01


def test_clocks_are_late() -> None:
    np.testing.assert_array_equal(changed(law("clock_offset"), late=0.02), 0.02)
    skew = changed(law("clock_skew"), skew=1e-3, set_at=-20.0)
    np.testing.assert_allclose(skew, 1e-3 * (T + 20.0), atol=1e-15)
    # One that was set long ago is late by one number.
    ago = changed(law("clock_skew"), skew=1e-6, set_at=-2e4)
    np.testing.assert_allclose(ago, changed(law("clock_offset"), late=0.02), rtol=0.01)
    wander = changed(law("clock_wander"), wander_sin=0.01, wander_cos=0.0, wander_period=40.0)
    np.testing.assert_allclose(wander, 0.01 * np.sin(2.0 * np.pi * T / 40.0), atol=1e-15)
    dropped = changed(law("clock_drops"), dropped=0.02, drop_time=50.0)
    np.testing.assert_array_equal(dropped, np.where(T > 50.0, -0.02, 0.0))
    cold = changed(law("clock_warmup"), cold_skew=1e-3, cold_time=20.0, right_at=0.0)
    assert cold[0] == 0.0 and cold[-1] == pytest.approx(0.02, rel=0.01)
    np.testing.assert_allclose(np.diff(cold)[:3] / np.diff(T)[:3], 1e-3, rtol=0.01)
    settling = changed(law("clock_warmup"), cold_skew=-1e-3, cold_time=20.0, right_at=1e4)
    np.testing.assert_allclose(settling, 0.02 * np.exp(-T / 20.0), atol=1e-15)
    # One that settles at once is set wrong, one that never does runs fast.
    slow = changed(law("clock_warmup"), cold_skew=1e-3, cold_time=1e5, right_at=0.0)
    np.testing.assert_allclose(slow, 1e-3 * T, rtol=1e-3)


def test_what_sticks_follows_until_it_slips() -> None:
    stop = changed(law("channel_play"), sticking=1.0, sticking_travel=0.5)
    first = np.flatnonzero(np.abs(stop) >= 1.0)[0]
    np.testing.assert_allclose(stop[:first], -(READING - READING[0])[:first] / 0.5, atol=1e-12)
    back = np.flatnonzero(np.diff(READING) < 0.0)[0]
    assert stop[back] == -1.0 and np.abs(stop).max() == 1.0
    # The whole loop is as wide as twice its half, whatever the rate.
    again = np.flatnonzero(READING[back:] < READING[back] - 1.0)[0] + back
    assert stop[again] == 1.0


def test_switching_is_a_square_wave_of_the_code() -> None:
    wave = changed(law("encoder_switching"), switching=1.0, switching_bit=11.0)
    period = 2.0 * np.pi / 2**14 * 2**11
    inside = READING % period
    np.testing.assert_array_equal(wave[(inside > 0.01) & (inside < 0.5 * period - 0.01)], 1.0)
    np.testing.assert_array_equal(wave[(inside > 0.5 * period + 0.01) & (inside < period - 0.01)], -1.0)


def constant(reading: Array, g: float) -> Array:
    return g * reading


def misspelt(readin: Array, g: float) -> Array:
    return g * readin


def mistyped(reading: float, g: float) -> Array:
    return np.array([g * reading])


G = Parameter("g", "1", Normal(0.0, 1.0), "gain", (-1.0, 1.0), role="amplitude")
SPARE = Parameter("h", "1", Normal(0.0, 1.0), "unused", (-1.0, 1.0))


@pytest.mark.parametrize(
    ("equation", "parameters", "message"),
    [(misspelt, (G,), "readin"), (constant, (G, SPARE), "not an argument"), (mistyped, (G,), "reading")],
)
def test_wrong_wiring_is_an_error_at_import(equation, parameters, message) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(TypeError, match=message):
        Sensing("trial", SensingPort.CHANNEL, equation, parameters)


def test_a_power_of_any_reading_is_in_the_span_of_the_curved_characteristic() -> None:
    middle, half = 0.5 * (READING.max() + READING.min()), 0.5 * (READING.max() - READING.min())
    effect, given = law("channel_nonlinearity"), {"bend_middle": float(middle), "bend_range": float(half)}
    zero = {f"bend_{n}": 0.0 for n in range(1, 7)}
    columns = [changed(effect, **given | zero | {name: 1.0}) for name in zero]
    basis = np.stack([*columns, np.ones_like(T)], axis=1)
    for power in (2, 3, 5):
        curved = READING**power
        left = curved - basis @ np.linalg.lstsq(basis, curved)[0]
        assert np.abs(left).max() < 1e-9 * np.abs(curved).max()


def test_a_curved_characteristic_is_held_beyond_its_range() -> None:
    effect = law("channel_nonlinearity")
    numbers = {f"bend_{n}": 0.1 * n for n in range(1, 7)} | {"bend_middle": float(READING.mean()), "bend_range": 1e-3}
    held = changed(effect, **numbers)
    assert set(np.round(held[np.abs(READING - READING.mean()) > 1e-3], 9)) <= {2.1, 0.3}


def test_a_drift_that_dies_out_has_one_relaxation_and_a_slower_one() -> None:
    drift = law("drift_exponential")
    one = changed(drift, creep=2.0, creep_slow=0.0, creep_time=7.0)
    np.testing.assert_allclose(one, 2.0 * np.exp(-T / 7.0), rtol=1e-12)
    slow = changed(drift, creep=0.0, creep_slow=2.0, creep_time=7.0)
    np.testing.assert_allclose(slow, changed(drift, creep=2.0, creep_slow=0.0, creep_time=28.0), rtol=1e-12)


def test_two_relaxations_follow_what_has_many_times() -> None:
    """Creep with the power of time (Findley) and its recovery, beside an offset and a line; one follows it less."""
    t = T[: round(75.0 / 0.05)]
    nature = 1.0 / (1.0 + t / 12.0) ** 0.7

    def left(columns: list[Array]) -> float:
        A = np.stack([np.ones_like(t), t, *columns], axis=1)
        return float(np.std(nature - A @ np.linalg.lstsq(A, nature)[0]))

    def terms(tau: float) -> list[Array]:
        drift, names = law("drift_exponential"), ("creep", "creep_slow")
        return [
            changed(drift, creep_time=tau, **{own: float(own == name) for own in names})[: len(t)] for name in names
        ]

    times = np.geomspace(2.0, 40.0, 30).tolist()
    one = min(left(terms(tau)[:1]) for tau in times)
    two = min(left(terms(tau)) for tau in times)
    assert two < 0.2 * one
    assert two < 3e-3 * float(np.ptp(nature))
