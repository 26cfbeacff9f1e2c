"""Rigs built in code for the tests of rigid bodies and gravity."""

from __future__ import annotations

import numpy as np

from kbs_process.rig.model import Body, Drive, Encoder, Joint, Quantity, Rig, Transducer
from kbs_process.signals.records import WRENCH_CHANNELS


def quantity(name, value, sigma=0.0, unit=""):
    value = np.asarray(value, dtype=float)
    return Quantity(name, value, unit, np.broadcast_to(np.asarray(sigma, float), value.shape).copy(), "test")


def body(name, on, mass, cog, inertia, s_mass=0.05, s_cog=0.003, s_inertia=0.0):
    at = f"body.{name}"
    return Body(
        name,
        on,
        quantity(f"{at}.mass", mass, s_mass),
        quantity(f"{at}.cog", cog, s_cog),
        quantity(f"{at}.inertia", inertia, s_inertia),
    )


def joint(
    name,
    parent,
    axis,
    origin=(0, 0, 0),
    mis=(0, 0, 0),
    *,
    s_mis=0.0,
    step=None,
    rotor=None,
    s_origin=0.0,
    s_offset=2e-4,
):
    at = f"joint.{name}"
    encoder = None
    if step is not None:
        encoder = Encoder(quantity(f"{at}.encoder.step", step), quantity(f"{at}.encoder.offset", 0.0, s_offset))
    drive = None
    if rotor is not None:
        drive = Drive(
            quantity(f"{at}.drive.ratio", 100.0),
            quantity(f"{at}.drive.rotor_inertia", rotor),
            quantity(f"{at}.drive.steps_per_turn", 12800.0),
            {},
        )
    return Joint(
        name,
        parent,
        axis,
        quantity(f"{at}.origin", origin, s_origin),
        quantity(f"{at}.misalignment", mis, s_mis),
        encoder,
        drive,
    )


def transducer(on="lab", tilt=(0, 0), stiffness=None, s_tilt=0.0, s_x=0.0, s_bias=(5.0, 0.5), channels=None):
    at = "transducer"
    return Transducer(
        on,
        WRENCH_CHANNELS if channels is None else channels,
        quantity(f"{at}.tilt", tilt, s_tilt),
        None if stiffness is None else quantity(f"{at}.stiffness", stiffness),
        None,
        quantity(f"{at}.cross_coupling", np.zeros((6, 6)), s_x),
        quantity(f"{at}.bias", np.zeros(6), np.repeat(s_bias, 3)),
        quantity(f"{at}.noise", np.repeat([0.02, 0.002], 3)),
        quantity(f"{at}.resolution", np.zeros(6)),
        None,
    )


def pointing_rig(*, rotor=2e-5, stiffness=(4000.0, 4000.0, 6000.0), step=3.834951969714103e-4, **changes):
    """The paper's mechanism: elevation over azimuth on a transducer that stands in the laboratory."""
    return Rig(
        quantity("gravity.magnitude", 9.80665),
        changes.pop("transducer", None) or transducer(stiffness=stiffness, s_tilt=1.5e-3),
        (
            body("base", "T", 8.0, [0, 0, 0.06], [0.05, 0.05, 0.04, 0, 0, 0]),
            body("azimuth", "az", 6.0, [0.01, -0.03, -0.02], [0.06, 0.05, 0.05, 0.002, 0, 0.001]),
            body("antenna", "el", 14.0, [0.07, 0.06, -0.02], [0.7, 0.9, 0.8, 0.01, -0.02, 0.03]),
        ),
        (
            joint("az", "T", (0, 0, 1), (0, 0, 0.22), s_mis=[3e-4, 3e-4, 0], step=step, rotor=rotor),
            joint("el", "az", (0, -1, 0), s_mis=[3e-4, 0, 3e-4], step=step, rotor=rotor),
        ),
        None,
        None,
    )


def wheel_rig():
    """An instrumented wheel: the transducer turns with the wheel that carries it; y_T is up at angle zero."""
    return Rig(
        quantity("gravity.magnitude", 9.80665),
        transducer(on="wheel", tilt=(np.pi / 2, 0.0)),
        (
            body("hub", "wheel", 2.0, [0.01, 0.0, 0.0], [0.1, 0.2, 0.1, 0, 0, 0]),
            body("pushrim", "T", 0.65, [0.01, -0.02, 0.035], [0.02, 0.02, 0.04, 0.001, 0, 0]),
        ),
        (joint("wheel", "lab", (0, -1, 0)),),
        None,
        None,
    )


def smooth_motion(joints, seconds=20.0, rate=200.0, seed=0):
    """Angles as sums of a few sines, with their exact derivatives, (n, joints) each."""
    rng = np.random.default_rng(seed)
    t = np.arange(int(seconds * rate)) / rate
    q, qd, qdd = (np.zeros((len(t), joints)) for _ in range(3))
    for index in range(joints):
        for _ in range(3):
            a, w, p = rng.uniform(0.1, 0.5), 2 * np.pi * rng.uniform(0.05, 0.5), rng.uniform(0, 6)
            q[:, index] += a * np.sin(w * t + p)
            qd[:, index] += a * w * np.cos(w * t + p)
            qdd[:, index] -= a * w**2 * np.sin(w * t + p)
    return t, q, qd, qdd
