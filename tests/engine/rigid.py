"""The rigid bodies as a MuJoCo model: base on three springs, two joints, two rotors.

World axes are those of the undeflected transducer T, so that an inclined set-up is inclined gravity.
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree as ET

import mujoco
import numpy as np

from engine.hardware import Array, Hardware

# Order of the joints, thus of generalised positions and velocities.
PLATE = slice(0, 3)
ROTOR_AZ, AZ, ROTOR_EL, EL = 3, 4, 5, 6
HOOK = "hook"  # site where a cord pulls at the antenna
BODY_NAMES = ("base", "azimuth", "antenna")

_ROTOR_MASS = 1e-9  # kg: MuJoCo wants some; the rotor's real mass counts in the body that carries it


@dataclass(frozen=True, slots=True, eq=False)
class RigidModel:
    """A compiled MuJoCo model with its state, and what the drives need to know of it."""

    model: mujoco.MjModel
    data: mujoco.MjData
    base: int  # body indices
    azimuth: int
    antenna: int


def gravity_in_plate(hardware: Hardware) -> Array:
    """Gravity in the undeflected T's axes, m/s^2, shape (3,), for its tilt (tx about x, ty about y)."""
    tx, ty = hardware["transducer.tilt"]
    direction = [np.sin(ty), -np.sin(tx) * np.cos(ty), -np.cos(tx) * np.cos(ty)]
    return hardware.scalar("gravity.magnitude") * np.array(direction)


def build(hardware: Hardware, timestep: float) -> RigidModel:
    """Compile the rigid bodies of `hardware` for MuJoCo.

    Each rotor is a disc with inertia Jr about its axis and Jr/2 across; MuJoCo refuses less. The
    Jr/2, which do not change as a disc turns, are taken from the body that carries the rotor, so
    that only the spin is left, and it is an absolute one.
    """
    root = ET.Element("mujoco")
    ET.SubElement(root, "compiler", angle="radian", autolimits="false")
    option = ET.SubElement(
        root, "option", timestep=repr(timestep), integrator="Euler", gravity=_text(gravity_in_plate(hardware))
    )
    off = ("contact", "constraint", "eulerdamp", "warmstart", "actuation")
    ET.SubElement(option, "flag", dict.fromkeys(off, "disable"))
    world = ET.SubElement(root, "worldbody")

    base = ET.SubElement(world, "body", name="base")
    for name, axis, k, c in zip(
        "xyz", np.eye(3), hardware["transducer.stiffness"], hardware["transducer.damping"], strict=True
    ):
        ET.SubElement(
            base, "joint", name=f"plate_{name}", axis=_text(axis), stiffness=repr(float(k)), damping=repr(float(c))
        )
    ET.SubElement(base, "site", name="T")

    mount_az = {"pos": _text(hardware["joint.az.origin"]), "quat": _quaternion(hardware["joint.az.misalignment"])}
    mount_el = {"pos": _text(hardware["joint.el.origin"]), "quat": _quaternion(hardware["joint.el.misalignment"])}
    axis_az, axis_el = np.array([0.0, 0.0, 1.0]), np.array([0.0, -1.0, 0.0])

    cross_az = _rotor(base, "az", mount_az, axis_az, hardware)
    _inertial(base, "base", hardware, _turned(cross_az, hardware["joint.az.misalignment"]))
    azimuth = ET.SubElement(base, "body", name="azimuth", **mount_az)
    ET.SubElement(azimuth, "joint", name="az", axis=_text(axis_az))
    cross_el = _rotor(azimuth, "el", mount_el, axis_el, hardware)
    _inertial(azimuth, "azimuth", hardware, _turned(cross_el, hardware["joint.el.misalignment"]))
    antenna = ET.SubElement(azimuth, "body", name="antenna", **mount_el)
    ET.SubElement(antenna, "joint", name="el", axis=_text(axis_el))
    if hardware.bungee is not None and hardware.bungee.hook is not None:
        ET.SubElement(antenna, "site", name=HOOK, pos=_text(hardware.bungee.hook))
    _inertial(antenna, "antenna", hardware, np.zeros((3, 3)))

    sensor = ET.SubElement(root, "sensor")
    ET.SubElement(sensor, "force", site="T")
    ET.SubElement(sensor, "torque", site="T")

    model = mujoco.MjModel.from_xml_string(ET.tostring(root, encoding="unicode"))
    names = [model.joint(index).name for index in range(model.njnt)]
    assert names == ["plate_x", "plate_y", "plate_z", "rotor_az", "az", "rotor_el", "el"], names
    return RigidModel(model, mujoco.MjData(model), *(model.body(name).id for name in BODY_NAMES))


def rotation(vector: Array) -> Array:
    """Rotation matrix of a rotation vector, shape (3, 3)."""
    quaternion, matrix = np.zeros(4), np.zeros(9)
    angle = float(np.linalg.norm(vector))
    axis = np.asarray(vector) / angle if angle > 0 else np.array([0.0, 0.0, 1.0])
    mujoco.mju_axisAngle2Quat(quaternion, axis, angle)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)


def mj_step_function() -> ctypes._CFuncPtr:
    """MuJoCo's own `mj_step(model, data)`, callable from compiled code with two addresses."""
    libraries = sorted(Path(mujoco.__file__).parent.glob("libmujoco*"))
    step = ctypes.CDLL(str(libraries[0])).mj_step
    step.argtypes, step.restype = [ctypes.c_void_p, ctypes.c_void_p], None
    return step


def _rotor(carrier: ET.Element, axis: str, mount: dict[str, str], spin: Array, hardware: Hardware) -> Array:
    """Add an axis's rotor to its carrier; return its inertia across the spin axis, in the mount's axes."""
    Jr = hardware.drive(axis, "rotor_inertia")
    body = ET.SubElement(carrier, "body", name=f"rotor_{axis}", **mount)
    ET.SubElement(body, "joint", name=f"rotor_{axis}", axis=_text(spin))
    across = Jr / 2 * (np.eye(3) - np.outer(spin, spin))
    inertia = across + Jr * np.outer(spin, spin)
    ET.SubElement(body, "inertial", pos="0 0 0", mass=repr(_ROTOR_MASS), diaginertia=_text(np.diag(inertia)))
    return across


def _inertial(body: ET.Element, name: str, hardware: Hardware, taken: Array) -> None:
    xx, yy, zz, xy, xz, yz = hardware[f"body.{name}.inertia"]
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) - taken
    full = (tensor[0, 0], tensor[1, 1], tensor[2, 2], tensor[0, 1], tensor[0, 2], tensor[1, 2])
    inertial = ET.Element(
        "inertial",
        pos=_text(hardware[f"body.{name}.cog"]),
        mass=repr(hardware.scalar(f"body.{name}.mass")),
        fullinertia=_text(full),
    )
    body.insert(0, inertial)


def _turned(tensor: Array, misalignment: Array) -> Array:
    R = rotation(misalignment)
    return R @ tensor @ R.T


def _quaternion(vector: Array) -> str:
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, rotation(vector).ravel())
    return _text(quaternion)


def _text(numbers: object) -> str:
    return " ".join(repr(float(number)) for number in np.ravel(np.asarray(numbers)))
