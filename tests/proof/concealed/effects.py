"""What can be concealed: each physics with its port, its family, and the ranges of its shapes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from engine.hardware import AXES, Array, Hardware
from engine.ports import Extra
from proof.concealed import sensing
from proof.concealed.laws import COLUMNS, SHAPES, STATES, Law, act
from proof.concealed.physics import Effect, Physics, Shape, Within
from proof.concealed.ranges import Choice, Phase, Range, Split
from proof.concealed.sensing import CHANNELS, Sense

_SIGMOID = Shape("sigmoid", "1", Choice((0.0,), (1.0,)))  # tanh or algebraic
_PHASE = Shape("phase", "rad", Phase())
_TURN = Range(0.04, 0.25)  # rad/s of a motor: where sliding friction is complete
_SLOW = Range(1e-3, 4e-3)  # rad/s of a joint
_MOTOR: dict[str, Any] = {"port": "motor torque", "places": AXES, "unit": "N m", "first": 5e-3, "most": 0.12}
_GEAR: dict[str, Any] = {"port": "transmission", "places": AXES}
_JOINT: dict[str, Any] = {"port": "joint torque", "places": AXES, "unit": "N m"}
_BASE: dict[str, Any] = {"port": "base", "places": ("",)}
_SHARP = Shape("sharpness", "1", Range(2.0, 12.0))

PHYSICS: tuple[Physics, ...] = (
    Physics(
        "smooth Stribeck friction", family="friction", law=Law.STRIBECK, **_MOTOR,
        shapes=(Shape("w_slide", "rad/s", _TURN), Shape("rise", "1", Range(0.3, 1.5)),
                Shape("w_stribeck", "rad/s", Range(0.2, 0.8)), _SIGMOID),
    ),
    Physics(
        "elastoplastic presliding", family="friction", law=Law.ELASTOPLASTIC, **_MOTOR,
        shapes=(Shape("z_slide", "rad", Range(4e-3, 4e-2)),),
    ),
    Physics(
        "cogging of another shape", family="cogging", law=Law.TOOTH_SHAPE, **_MOTOR,
        shapes=(Shape("harmonic", "1", Choice((0.5, 2.0), (1.5, 2.0))), Shape("skewness", "1", Range(0.15, 0.5)),
                _PHASE),
    ),
    Physics(
        "motor order, distorted", family="motor order", law=Law.MOTOR_ORDER, **_MOTOR,
        shapes=(Shape("order", "1", Choice((1.0, 4.0, 12.0), (3.0, 6.0, 24.0))),
                Shape("distortion", "1", Range(0.1, 0.5)), _PHASE),
    ),
    Physics(
        "drag with the cube of the rate", family="unnamed", law=Law.ODD_POWER, **_MOTOR, catalogued=False,
        shapes=(Shape("w_scale", "rad/s", Range(0.5, 1.2)),),
    ),
    Physics(
        "microsteps uneven", family="microstep", law=Law.MICROSTEP, port="motor torque", places=AXES, unit="rad",
        first=0.02, most=0.6, shapes=(Shape("per electrical cycle", "1", Choice((4.0,), (1.0, 8.0))), _PHASE),
    ),
    Physics(
        "lubricant warming up", family="warm-up", law=Law.WARM_UP, **_MOTOR,
        shapes=(Shape("w_slide", "rad/s", _TURN), Shape("time", "s", Range(20.0, 80.0)), Shape("", "1", 0.0), _SIGMOID),
    ),
    Physics(
        "rub once a motor turn", family="unnamed", law=Law.RUB, **_MOTOR, catalogued=False,
        shapes=(Shape("w_slide", "rad/s", _TURN), Shape("where", "rad", Phase()),
                Shape("narrowness", "1", Range(2.0, 20.0)), _SIGMOID),
    ),
    Physics(
        "friction by the other axis's rate", family="unnamed", law=Law.CROSS_AXIS, **_MOTOR, catalogued=False,
        shapes=(Shape("w_slide", "rad/s", _TURN), Shape("w_other", "rad/s", Range(0.1, 0.8)), Shape("", "1", 0.0),
                _SIGMOID),
    ),
    Physics(
        "sawtooth in the motor's angle", family="unnamed", law=Law.SAWTOOTH, **_MOTOR, catalogued=False,
        shapes=(Shape("order", "1", Choice((8.0, 16.0), (5.0, 20.0))), _PHASE, _SHARP),
    ),
    Physics(
        "rounded triangle of transmission error", family="transmission error", law=Law.TRANSMISSION_ERROR, **_GEAR,
        unit="rad", first=2e-5, most=2e-3,
        shapes=(Shape("order", "1", Choice((2.0,), (2.0, 4.0))), _PHASE,
                Shape("sharpness", "1", Range(0.7, 0.98, log=False))),
    ),
    Physics(
        "compliant backlash", family="backlash", law=Law.BACKLASH, **_GEAR, unit="rad", first=3e-5, most=2e-3,
        shapes=(Shape("rounding", "rad", Range(2e-6, 2e-5)), Shape("softness", "1", Range(0.4, 0.95)),
                Shape("centre", "rad", 0.0)),
    ),
    Physics(
        "exponential stiffening", family="stiffness", law=Law.STIFFENING, port="transmission",
        places=("el",), unit="1", first=1.0, most=30.0,
        shapes=(Shape("windup", "rad", Range(4e-4, 1.5e-3)),),
    ),
    Physics(
        "Bouc-Wen hysteresis of the gear", family="hysteresis", law=Law.BOUC_WEN, **_GEAR, unit="N m", first=0.2,
        most=5.0, shapes=(Shape("width", "rad", Range(5e-6, 8e-5)), Shape("power", "1", Range(0.8, 2.5))),
    ),
    Physics(
        "exponential harness", family="harness", law=Law.HARNESS, **_JOINT, first=0.2, most=20.0,
        shapes=(Shape("rest", "rad", Within()), Shape("scale", "rad", Range(0.15, 0.5))),
    ),
    Physics(
        "harness of three stops", family="hysteresis", law=Law.STOPS, **_JOINT, first=0.2, most=20.0,
        shapes=(Shape("travel", "rad", Range(2e-3, 3e-2)),),
    ),
    Physics(
        "smooth bearing friction", family="friction", law=Law.BEARING, **_JOINT, first=0.2, most=1.5,
        shapes=(Shape("w_slide", "rad/s", _SLOW), Shape("", "1", 0.0), Shape("", "1", 0.0), _SIGMOID),
    ),
    Physics(
        "bump in a bearing", family="local torque", law=Law.BUMP, **_JOINT, first=0.2, most=20.0,
        shapes=(Shape("where", "rad", Within(0.35, 0.65)), Shape("half width", "rad", Range(0.01, 0.06))),
    ),
    Physics(
        "sawtooth in the joint's angle", family="unnamed", law=Law.JOINT_SAWTOOTH, **_JOINT, first=0.2, most=20.0,
        catalogued=False, shapes=(Shape("order", "1", Choice((24.0, 36.0), (18.0, 48.0))), _PHASE, _SHARP),
    ),
    Physics(
        "saturating cable to the ground", family="cable", port="external wrench", law=Law.CABLE, places=("az",),
        unit="N m", first=0.02, most=2.0,
        shapes=(Shape("rest", "rad", Within()), Shape("scale", "rad", Range(0.05, 0.4)), Shape("", "1", 0.0), _SIGMOID),
    ),
    Physics(
        "Bouc-Wen cable to the ground", family="cable", port="external wrench", law=Law.CABLE_BOUC_WEN,
        places=("az",), unit="N m", first=0.02, most=2.0,
        shapes=(Shape("width", "rad", Range(5e-3, 0.1)), Shape("power", "1", Range(0.8, 2.5))),
    ),
    Physics(
        "rubber cord", family="bungee", port="external wrench", law=Law.CORD, places=("el",), unit="N", first=0.5,
        most=100.0,
        shapes=(Shape("rest length", "m", Range(0.5, 1.2)), Shape("anchor x", "m", Range(-0.8, 0.8, log=False)),
                Shape("anchor y", "m", Range(-0.8, 0.8, log=False)), Shape("anchor z", "m", Range(0.9, 1.6)),
                Shape("point x", "m", Range(0.1, 0.5)), Shape("point y", "m", Range(-0.3, 0.3, log=False)),
                Shape("point z", "m", Range(-0.2, 0.2, log=False))),
    ),
    Physics(
        "drag of the air", family="air drag", port="external wrench", law=Law.AIR, places=("el",),
        unit="N/(m/s)^1.8", first=20.0, most=3e3,
        shapes=(Shape("point x", "m", Range(0.3, 0.7)), Shape("point y", "m", Range(-0.4, 0.4, log=False)),
                Shape("point z", "m", Range(-0.3, 0.3, log=False))),
    ),
    Physics(
        "mass that slides", family="mass", port="mass properties", law=Law.SHIFTING_MASS, places=("el",),
        unit="kg m", first=2e-3, most=0.3,
        shapes=(Shape("fall", "1", Range(0.03, 0.2)), Shape("along", "1", Choice((0.0, 2.0), (1.0, 2.0))),
                Shape("", "1", 0.0), _SIGMOID),
    ),
    Physics(
        "chirp of the floor", family="vibration", law=Law.FLOOR_VIBRATION, **_BASE, unit="m/s^2", first=1e-4, most=0.05,
        shapes=(Shape("frequency", "Hz", Range(0.4, 5.0)), Shape("chirp", "Hz/s", Range(1e-5, 2e-3)), _PHASE,
                Shape("x", "1", Range(-1.0, 1.0, log=False)), Shape("y", "1", Range(-1.0, 1.0, log=False)),
                Shape("z", "1", Range(-0.4, 0.4, log=False))),
    ),
    Physics(
        "exponential stiffening of the base", family="stiffness", law=Law.PLATE_STIFFENING, **_BASE, unit="N m/rad",
        first=200.0, most=2e4,
        shapes=(Shape("about", "1", Choice((0.0, 1.0), (0.0, 1.0))), Shape("angle", "rad", Range(5e-4, 2e-3))),
    ),
    Physics(
        "stops in the base", family="hysteresis", law=Law.PLATE_STOPS, **_BASE, unit="N m", first=0.02, most=2.0,
        shapes=(Shape("about", "1", Choice((0.0, 1.0), (0.0, 1.0))), Shape("travel", "rad", Range(2e-6, 4e-5))),
    ),
    Physics(
        "floor that settles", family="tilt", law=Law.FLOOR_TILT, **_BASE, unit="rad", first=2e-5, most=5e-3,
        shapes=(Shape("time", "s", Range(5.0, 25.0)), Shape("towards", "rad", Phase())),
    ),
    Physics(
        "mass on a spring", family="appendage", port="appendage", comparable=True, law=Law.APPENDAGE, places=("el",),
        unit="kg", first=0.05, most=0.6,
        shapes=(Shape("frequency", "Hz", Range(0.6, 4.5)), Shape("damping", "1", Range(2e-3, 2e-2)),
                Shape("x", "1", Choice((0.0, 0.6), (0.6, 0.0))), Shape("y", "1", Choice((1.0, 0.8), (0.8, 0.0))),
                Shape("z", "1", Choice((0.0,), (1.0, 0.6))), Shape("point x", "m", Range(0.3, 0.8)),
                Shape("point y", "m", Range(-0.4, 0.4, log=False)), Shape("point z", "m", Range(-0.3, 0.3, log=False))),
    ),
    Physics(
        "field that lags", family="latency", port="controller", law=Sense.FIELD_LAG, places=AXES, unit="s",
        first=2e-3, most=0.2, comparable=True,
    ),
    Physics(
        "cycles that come late", family="jitter", port="controller", law=Sense.LATE_CYCLES, places=AXES, unit="1",
        first=0.2, most=1.0, shapes=(Shape("every", "1", Choice((7.0, 16.0), (5.0, 23.0))),),
    ),
    Physics(
        "S-shaped channel", family="non-linearity", port="transducer", law=Sense.S_SHAPE,
        places=("Fx", "Fy", "Tx", "Ty", "Tz"), unit="1", first=1e-2, most=1.0,
        shapes=(Shape("centre", "span", Range(0.3, 0.7, log=False)), Shape("width", "span", Range(0.15, 0.4))),
    ),
    Physics(
        "channel with play", family="sensor hysteresis", port="transducer", law=Sense.PLAY,
        places=("Fx", "Fy", "Tx", "Ty", "Tz"), unit="1", first=1e-2, most=0.5,
        shapes=(Shape("travel", "span", Range(0.02, 0.15)),),
    ),
    Physics(
        "channel that warms up", family="drift", port="transducer", law=Sense.WARMING, places=CHANNELS, unit="sigma",
        first=1.0, most=500.0, shapes=(Shape("time", "s", Range(5.0, 25.0)),),
    ),
    Physics(
        "channel that creeps", family="lag", port="transducer", law=Sense.CREEP,
        places=("Fx", "Fy", "Tx", "Ty", "Tz"), unit="1", first=1e-2, most=0.5,
        shapes=(Shape("time", "s", Range(0.5, 12.0)),),
    ),
    Physics(
        "product of channels", family="product", port="transducer", law=Sense.PRODUCT,
        places=("Fx<-Tx", "Fy<-Ty", "Tz<-Ty", "Tx<-Ty", "Ty<-Tx"), unit="sigma", first=1.0, most=500.0,
    ),
    Physics(
        "converter with a step", family="converter", port="transducer", law=Sense.STEP,
        places=("Fx", "Fy", "Tx", "Ty"), unit="sigma", first=1.0, most=100.0,
        shapes=(Shape("where", "span", Range(0.3, 0.7, log=False)),),
    ),
    Physics(
        "disc off its centre, twice", family="eccentricity", port="encoder", law=Sense.ECCENTRIC, places=AXES,
        unit="rad", first=1e-4, most=2e-2, shapes=(_PHASE, Shape("twice", "1", Range(0.2, 0.8))),
    ),
    Physics(
        "interpolation of the code", family="converter", port="encoder", law=Sense.INTERPOLATION, places=AXES,
        unit="rad", first=1e-4, most=5e-3,
        shapes=(Shape("order", "1", Choice((64.0, 128.0), (32.0, 256.0))), Shape("distortion", "1", Range(0.1, 0.5)),
                _PHASE),
    ),
    Physics(
        "sawtooth in the disc's angle", family="unnamed", port="encoder", law=Sense.SAWTOOTH, places=AXES, unit="rad",
        first=1e-4, most=5e-3, catalogued=False,
        shapes=(Shape("order", "1", Choice((20.0, 40.0), (12.0, 72.0))), _PHASE),
    ),
    Physics(
        "disc with play", family="sensor hysteresis", port="encoder", law=Sense.DIRECTION, places=AXES, unit="rad",
        first=1e-4, most=5e-3, shapes=(Shape("w_turn", "rad/s", _SLOW),),
    ),
    Physics(
        "clock that jumps", family="drops", port="clock", law=Sense.JUMP, places=("wrench", "encoder"), unit="s",
        first=0.02, most=1.0, shapes=(Shape("when", "1", Range(0.3, 0.7, log=False)),),
    ),
    Physics(
        "clock that wanders", family="wander", port="clock", law=Sense.WANDER, places=("wrench", "encoder"), unit="s",
        first=0.02, most=1.0, shapes=(Shape("period", "s", Range(12.0, 50.0)), _PHASE),
    ),
    Physics(
        "clock that warms up", family="skew", port="clock", law=Sense.CLOCK_WARMING, places=("wrench", "encoder"),
        unit="1", first=1e-3, most=0.05, shapes=(Shape("time", "s", Range(60.0, 240.0)),),
    ),
)  # fmt: skip

BY_NAME = {physics.name: physics for physics in PHYSICS}


def draw(physics: Physics, rng: np.random.Generator, split: Split, swept: dict[str, tuple[float, float]]) -> Effect:
    """Draw a place and shapes; `swept` is each joint's range of angles (rad) in the fit recordings."""
    place = str(rng.choice(physics.places))
    shapes: list[float] = []
    for shape in physics.shapes:
        if isinstance(shape.drawn, Within):
            low, high = swept[place]
            u = rng.uniform(shape.drawn.low, shape.drawn.high)
            shapes.append(float(low + u * (high - low)))
        elif isinstance(shape.drawn, float):
            shapes.append(shape.drawn)
        else:
            shapes.append(shape.drawn.draw(rng, split))
    return Effect(physics, place, tuple(shapes), physics.first)


def extra(effects: tuple[Effect, ...], hardware: Hardware, spans: Array, duration: float) -> Extra:
    """What the engine lets act. `spans` (6, 2): least and greatest reading of each channel in the fit recordings."""
    rows: list[Array] = []
    for effect in effects:
        if isinstance(effect.physics.law, Law):
            row = np.zeros(COLUMNS)
            axis = AXES.index(effect.place) if effect.place in AXES else 0
            drive = [hardware.drive(AXES[axis], key) for key in ("ratio", "Ka", "fsv", "Tmax", "Kangle")]
            row[:SHAPES] = [float(effect.physics.law), axis, effect.amplitude, *drive]
            row[SHAPES : SHAPES + len(effect.shapes)] = effect.shapes
            rows.append(row)
    senses = [
        (effect.physics.law, effect.place, effect.amplitude, effect.shapes)
        for effect in effects
        if isinstance(effect.physics.law, Sense)
    ]
    sensed = sensing.extra(senses, hardware, spans, duration)
    return replace(sensed, act=act, numbers=np.array(rows), states=STATES) if rows else sensed
