"""Plants side by side show what each shows alone, whatever runs beside it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from kbs_process.errors import ConfigError
from kbs_process.plant.attach import attach
from kbs_process.plant.compiled.simulation import Simulation
from kbs_process.plant.laws import select
from kbs_process.plant.predict import LANES, predict, predict_together, simulation_of
from kbs_process.plant.schedule import Schedule
from kbs_process.rig.model import Rig, substitute
from kbs_process.signals.records import Array
from plant.plant_rigs import NOMINAL, one_axis, two_axis

pytestmark = pytest.mark.slow

SECONDS = 6.0
RATES: dict[str, Any] = {"rate_Hz": 100.0, "angle_rate_Hz": 40.0, "duration_s": SECONDS}
BEFORE = 0.73  # s, that commands begin before the recording
CROSSING = "joint_other_rate_law"
MOUNTING = ["base_hardening", "base_hysteresis"]
BENT = [*NOMINAL, CROSSING, *MOUNTING]
WITH_STATES = [*NOMINAL, "controller_lag", "controller_latency", "ground_cable", "bungee"]


def schedule(joints: int) -> Schedule:
    t = np.arange(-BEFORE, SECONDS + 0.2, 0.1)
    rate = np.outer(0.03 * np.sin(2 * np.pi * (t + BEFORE) / 4.0), np.arange(1, joints + 1))
    return Schedule(t, 0.4 + 0.1 * np.cumsum(rate, axis=0), rate)


def loaded(loop: str) -> Rig:
    """With two delays of a field, a torque of the laboratory that has a state, and a force that pulls at a link."""
    lag, late, cable, bungee = select(["controller_lag", "controller_latency", "ground_cable", "bungee"])
    rig = attach(two_axis(loop=loop, latency=2), cable, {"cable_spring": 0.3, "cable_friction": 0.2}, joints=["el"])
    rig = attach(rig, late, {"field_latency": 4e-3}, joints=["el"])
    rig = attach(rig, lag, {"set_point_lag": 0.13}, joints=["el"])
    numbers = {"stiffness": 30.0, "free_length": 0.5, "anchor_z": 1.5}
    return attach(rig, bungee, numbers, on="el", point=np.array([0.1, 0.0, 0.2]))


def bent() -> Rig:
    """With a torque of the elevation over the azimuth's rate, on a mounting that stiffens and slips: its states."""
    (law,), (hardening, hysteresis) = select([CROSSING]), select(MOUNTING)
    over_rate = {f"other_rate_law_{k}": 0.05 * k**2 for k in range(10)}
    rig = attach(two_axis(), law, over_rate | {"other_rate_law_low": -0.05, "other_rate_law_high": 0.05}, joints=["el"])
    rig = attach(rig, hardening, {"base_hardening_x": 0.5, "base_hardening_y": 0.5})
    return attach(rig, hysteresis, {"base_loop_x": 0.1, "base_loop_y": 0.1, "base_loop_z": 0.1})


def test_a_joint_has_another_one_to_depend_on() -> None:
    rig, (law,) = one_axis(), select([CROSSING])
    with pytest.raises(ConfigError, match="one alone"):
        begun([attach(rig, law)], [*NOMINAL, CROSSING])


def varied(rig: Rig, count: int) -> list[Rig]:
    """Rigs of one structure; friction sticks in some of them."""
    joint = rig.joints[-1].name
    return [
        substitute(
            rig,
            {
                f"joint.{joint}.drive.parameters.Ka": 1e4 * (1.0 + 0.1 * k),
                f"joint.{joint}.drive.parameters.Ts0": 4e-3 * k,
                f"joint.{joint}.encoder.offset": 1e-3 * k,
            },
        )
        for k in range(count)
    ]


def begun(rigs: list[Rig], effects: list[str]) -> list[Simulation]:
    return [simulation_of(rig, effects, schedule(len(rig.joints)), **RATES) for rig in rigs]


def together(rigs: list[Rig], effects: list[str]) -> list[tuple[Array, Array]]:
    return predict_together(begun(rigs, effects), RATES["rate_Hz"], SECONDS)


def alone(rig: Rig, effects: list[str]) -> tuple[Array, Array]:
    streams: dict[str, list[Array]] = {"wrench": [], "angle": [], "field": []}
    for key, block in predict(rig, effects, schedule(len(rig.joints)), **RATES, quantise=False):
        streams[key].append(block.values)
    return np.concatenate(streams["wrench"]), np.concatenate(streams["angle"])


@pytest.mark.parametrize(
    ("rig", "effects"),
    [
        (loaded("open"), WITH_STATES),
        (loaded("closed"), WITH_STATES),
        (one_axis(stiffness=None, amplifier=None), list(NOMINAL)),
        (bent(), BENT),
    ],
    ids=["open loop", "closed loop", "rigid base, no amplifier", "one axis acts on the other, a mounting has states"],
)
def test_each_shows_what_it_shows_alone(rig: Rig, effects: list[str]) -> None:
    rigs = varied(rig, 3)
    wrenches, angles = zip(*together(rigs, effects), strict=True)
    apart = np.ptp(np.stack(wrenches), axis=0).max()
    assert apart > 1e-3  # N, N m: they do differ
    for one, wrench, angle in zip(rigs, wrenches, angles, strict=True):
        expected, turned = alone(one, effects)
        # Products may be fused into sums in other places: rounding, and what friction makes of it.
        np.testing.assert_allclose(wrench, expected, atol=1e-6)
        np.testing.assert_allclose(angle, turned, atol=1e-10)


@pytest.mark.parametrize(("rig", "effects"), [(loaded("open"), WITH_STATES), (bent(), BENT)], ids=["loads", "mounting"])
def test_no_bit_depends_on_what_runs_beside_it(rig: Rig, effects: list[str]) -> None:
    rigs = varied(rig, LANES + 3)
    several = together(rigs, effects)
    assert len(several) == LANES + 3
    for k in (0, LANES - 1, LANES + 2):
        ((wrench, angle),) = together([rigs[k]], effects)
        np.testing.assert_array_equal(wrench, several[k][0])
        np.testing.assert_array_equal(angle, several[k][1])


def test_one_that_diverges_leaves_the_others_alone() -> None:
    first, second = varied(loaded("open"), 2)
    path = "joint.el.drive.parameters.fsv"
    wild = substitute(first, {path: -1e5})
    (good, _), (bad, _) = together([second, wild], WITH_STATES)
    assert not np.isfinite(bad).all()
    np.testing.assert_array_equal(good, together([second], WITH_STATES)[0][0])


def test_plants_of_other_structure_are_refused() -> None:
    other = begun([two_axis()], list(NOMINAL))
    with pytest.raises(ValueError, match="alike in structure"):
        predict_together([*begun([loaded("open")], WITH_STATES), *other], RATES["rate_Hz"], SECONDS)
