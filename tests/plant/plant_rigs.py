"""Rigs of known numbers for the tests of the plant."""

from __future__ import annotations

from typing import Any

import numpy as np

from kbs_process.plant.predict import predict
from kbs_process.plant.schedule import Schedule
from kbs_process.rig.model import Amplifier, Body, Controller, Drive, Encoder, Joint, Quantity, Rig, Transducer
from kbs_process.signals.records import Array

NOMINAL = ("synchronous_motor", "cogging", "motor_viscous", "dynamic_friction", "tooth_stiction", "flexspline")
CODE = 2.0 * np.pi / 2**14
DRIVE = {
    "Tmax": 0.35, "Kangle": 100.0, "tcog": 6e-3, "phi_cog": 0.0, "b_m": 2e-3, "d0": 0.012, "d1": 0.006,
    "phi_dyn": 0.0, "w_dyn": 0.05, "Ts0": 6e-3, "delta": 0.5, "phi_stat": 0.0, "fsv": 15.0, "Ka": 1e4,
}  # fmt: skip


def quantity(name: str, value: Any) -> Quantity:
    array = np.asarray(value, dtype=float)
    return Quantity(name, array, "SI", np.zeros_like(array), "test")


def body(name: str, on: str, mass: float, cog: Any, inertia: Any) -> Body:
    tensor = [*inertia, 0.0, 0.0, 0.0] if len(inertia) == 3 else inertia
    path = f"body.{name}"
    return Body(
        name, on, quantity(f"{path}.mass", mass), quantity(f"{path}.cog", cog), quantity(f"{path}.inertia", tensor)
    )


def joint(
    name: str,
    parent: str,
    axis: tuple[float, float, float],
    origin: Any,
    *,
    misalignment: Any = (0.0, 0.0, 0.0),
    ratio: float = 100.0,
    rotor: float = 2e-5,
    code: float = CODE,
    **parameters: float,
) -> Joint:
    path = f"joint.{name}"
    values = {key: quantity(f"{path}.drive.parameters.{key}", value) for key, value in (DRIVE | parameters).items()}
    drive = Drive(
        quantity(f"{path}.drive.ratio", ratio),
        quantity(f"{path}.drive.rotor_inertia", rotor),
        quantity(f"{path}.drive.steps_per_turn", 12800),
        values,
    )
    encoder = Encoder(quantity(f"{path}.encoder.step", code), quantity(f"{path}.encoder.offset", 0.0))
    return Joint(
        name,
        parent,
        axis,
        quantity(f"{path}.origin", origin),
        quantity(f"{path}.misalignment", misalignment),
        encoder,
        drive,
    )


def rig(
    bodies: tuple[Body, ...],
    joints: tuple[Joint, ...],
    *,
    gravity: float = 9.80665,
    tilt: Any = (0.0, 0.0),
    stiffness: Any = (4000.0, 4000.0, 6000.0),
    damping: Any = (1.3, 1.3, 1.2),
    amplifier: tuple[int, float] | None = (2, 20.0),
    loop: Any = "open",
    Kp: float = 0.05,
    Ki: float = 0.01,
    latency: int = 1,
) -> Rig:
    low_pass = (
        None if amplifier is None else Amplifier(amplifier[0], quantity("transducer.amplifier.corner", amplifier[1]))
    )
    transducer = Transducer(
        "lab",
        ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz"),
        quantity("transducer.tilt", tilt),
        None if stiffness is None else quantity("transducer.stiffness", stiffness),
        None if stiffness is None else quantity("transducer.damping", damping),
        quantity("transducer.cross_coupling", np.zeros((6, 6))),
        quantity("transducer.bias", np.zeros(6)),
        quantity("transducer.noise", [0.02] * 3 + [0.002] * 3),
        quantity("transducer.resolution", np.zeros(6)),
        low_pass,
    )
    controller = Controller(
        quantity("controller.cycle", 0.1),
        loop,
        quantity("controller.Kp", [Kp] * len(joints)),
        quantity("controller.Ki", [Ki] * len(joints)),
        latency,
    )
    return Rig(quantity("gravity.magnitude", gravity), transducer, bodies, joints, controller, None)


def two_axis(*, drive: dict[str, float] | None = None, misalignment: Any = (0.0, 0.0, 0.0), **settings: Any) -> Rig:
    """The antenna pointing mechanism with the defaults of the plant's description."""
    bodies = (
        body("base", "T", 8.0, (0.0, 0.0, 0.06), (0.05, 0.05, 0.04)),
        body("azimuth", "az", 6.0, (0.01, -0.03, -0.02), (0.06, 0.05, 0.05)),
        body("antenna", "el", 14.0, (0.07, 0.06, -0.02), (0.7, 0.9, 0.8)),
    )
    joints = (
        joint("az", "T", (0.0, 0.0, 1.0), (0.0, 0.0, 0.22), **(drive or {})),
        joint("el", "az", (0.0, -1.0, 0.0), (0.0, 0.0, 0.0), misalignment=misalignment, **(drive or {})),
    )
    return rig(bodies, joints, **settings)


def one_axis(axis: tuple[float, float, float] = (0.0, -1.0, 0.0), **settings: Any) -> Rig:
    """A single driven joint with an unbalanced load."""
    bodies = (
        body("base", "T", 3.0, (0.02, -0.01, 0.05), (0.03, 0.02, 0.02)),
        body("load", "tip", 5.0, (0.05, 0.01, 0.03), (0.2, 0.3, 0.25, 0.01, -0.02, 0.015)),
    )
    return rig(bodies, (joint("tip", "T", axis, (0.01, 0.02, 0.15)),), **settings)


def three_axis(**settings: Any) -> Rig:
    """Three joints about skew axes, misaligned, with full inertia tensors."""
    bodies = (
        body("base", "T", 8.0, (0.01, 0.02, 0.06), (0.05, 0.05, 0.04)),
        body("a", "one", 4.0, (0.02, -0.05, 0.1), (0.05, 0.06, 0.04, 0.003, -0.004, 0.002)),
        body("b", "two", 3.0, (0.1, 0.03, 0.02), (0.03, 0.05, 0.04, -0.002, 0.001, 0.003)),
        body("c", "three", 2.0, (0.05, -0.08, 0.04), (0.02, 0.01, 0.03, 0.001, 0.002, -0.001)),
    )
    joints = (
        joint("one", "T", (0.0, 0.0, 1.0), (0.02, 0.01, 0.2), misalignment=(0.02, -0.01, 0.0)),
        joint("two", "one", (0.0, -1.0, 0.0), (0.1, 0.0, 0.15), misalignment=(0.01, 0.0, 0.03)),
        joint("three", "two", (0.6, 0.0, 0.8), (0.2, 0.02, 0.0)),
    )
    return rig(bodies, joints, **settings)


def streams(of: Rig, effects: tuple[str, ...], schedule: Schedule, **settings: Any) -> dict[str, Array]:
    """Predict and return the values of each stream in one piece."""
    blocks: dict[str, list[Array]] = {}
    for key, block in predict(of, effects, schedule, **settings):
        blocks.setdefault(key, []).append(block.values)
    return {key: np.concatenate(values) for key, values in blocks.items()}
