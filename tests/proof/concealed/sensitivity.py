"""What known parameters change in the readings: finite differences by the engine, times the campaign's sigmas.

Drives, bodies, joints and the transducer's springs are simulated (coarse step, the field of the first run), for most of
what an inertia changes is how the whole rings. Cross-coupling and encoder offsets are exact.
"""

from __future__ import annotations

import numpy as np

from engine.hardware import AXES, BODIES, Array, Hardware
from proof.concealed.observed import Motion
from proof.concealed.ranges import RUN_TO_RUN

DRIVE = (
    "Tmax", "tcog", "phi_cog", "b_m", "d0", "d1", "phi_dyn", "w_dyn", "Ts0", "delta", "phi_stat", "fsv", "Ka",
)  # fmt: skip
RUN_FRICTION = ("b_m", "d0", "d1", "Ts0")
_PHASE_STEP = 0.1  # rad
_SHARE = 0.3  # of a sigma: step of all other differences
_RIGID = (
    "transducer.tilt", *(f"body.{name}.{what}" for name in BODIES for what in ("mass", "cog", "inertia")),
    *(f"joint.{axis}.{what}" for axis in AXES for what in ("origin", "misalignment")),
)  # fmt: skip

Named = tuple[str, int]  # quantity, element


def columns(motion: Motion) -> tuple[dict[Named, Array], Array]:
    """Sensitivities (n, 8) times sigma by parameter; and what differs from run to run, (n, 8, m)."""
    readings = motion.observed()
    simulated = _simulated(motion, readings)
    coupling = _coupling(motion.hardware, readings)
    hardware = motion.hardware
    own: list[Array] = []
    for axis in AXES:
        for name in RUN_FRICTION:
            key = f"joint.{axis}.drive.{name}"
            own.append(_relative(hardware, simulated, key) * RUN_TO_RUN["friction"])
    warmth = [_relative(hardware, simulated, f"joint.{axis}.drive.{n}") for axis in AXES for n in ("b_m", "d0")]
    own.append(np.sum(warmth, axis=0) * RUN_TO_RUN["temperature"])
    tilt = hardware.sigmas["transducer.tilt"]
    own += [simulated["transducer.tilt", k] * (RUN_TO_RUN["tilt"] / tilt[k]) for k in (0, 1)]
    return simulated | coupling, np.stack(own, axis=2)


def _relative(hardware: Hardware, simulated: dict[Named, Array], key: str) -> Array:
    """Sensitivity to a share of the value."""
    return simulated[key, 0] * (hardware.scalar(key) / float(hardware.sigmas[key]))


def perturbed(hardware: Hardware, name: Named, change: float) -> Hardware:
    """Return the hardware with one element of a quantity moved."""
    value = np.array(hardware[name[0]], dtype=float)
    value.reshape(-1)[name[1]] += change
    return hardware.with_values({name[0]: value})


def uncertain(hardware: Hardware, key: str) -> list[tuple[Named, float]]:
    """Elements of a quantity that have a sigma."""
    sigmas = np.ravel(hardware.sigmas[key])
    return [((key, k), float(s)) for k, s in enumerate(sigmas) if s > 0]


def _simulated(motion: Motion, readings: Array) -> dict[Named, Array]:
    keys = [f"joint.{axis}.drive.{name}" for axis in AXES for name in DRIVE]
    keys += ["transducer.stiffness", "transducer.damping", *_RIGID]
    out: dict[Named, Array] = {}
    for key in keys:
        for name, sigma in uncertain(motion.hardware, key):
            step = _PHASE_STEP if ".phi_" in key else _SHARE * sigma
            moved = motion.observed(perturbed(motion.hardware, name, step))
            out[name] = (moved - readings) * (sigma / step)
    return out


def _coupling(hardware: Hardware, readings: Array) -> dict[Named, Array]:
    acting = np.linalg.solve(np.eye(6) + hardware["transducer.cross_coupling"], readings[:, :6].T).T
    out: dict[Named, Array] = {}
    for name, sigma in uncertain(hardware, "transducer.cross_coupling"):
        row, column = divmod(name[1], 6)
        out[name] = np.zeros_like(readings)
        out[name][:, row] = sigma * acting[:, column]
    for k, axis in enumerate(AXES):
        for name, sigma in uncertain(hardware, f"joint.{axis}.encoder.offset"):
            out[name] = np.zeros_like(readings)
            out[name][:, 6 + k] = sigma
    return out
