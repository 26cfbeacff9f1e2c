"""The words in which a diagnosis speaks of suspects: port, and family of physics."""

from __future__ import annotations

from kbs_process.plant.effect import Port
from kbs_process.plant.sensing import SensingPort

PORTS: dict[Port | SensingPort, str] = {
    Port.FIELD: "controller",
    Port.MOTOR_TORQUE: "motor torque",
    Port.MOTOR_FRICTION: "motor torque",
    Port.TRANSMISSION: "transmission",
    Port.JOINT_TORQUE: "joint torque",
    Port.GROUND_TORQUE: "external wrench",
    Port.EXTERNAL_FORCE: "external wrench",
    Port.BASE_ACCELERATION: "base",
    Port.BASE_TORQUE: "base",
    SensingPort.CHANNEL: "transducer",
    SensingPort.COUPLING: "transducer",
    SensingPort.PRODUCT: "transducer",
    SensingPort.ENCODER: "encoder",
    SensingPort.STREAM: "clock",
}
# Laws that are at a port of their own, wherever their equations act.
_APART = {"appendage": "appendage", "mass_shift": "mass properties"}

UNNAMED = "unnamed"  # of laws that are measured

FAMILIES: dict[str, str] = {
    "cogging": "cogging",
    "motor_viscous": "viscous",
    "dynamic_friction": "friction",
    "tooth_stiction": "stiction",
    "motor_order": "motor order",
    "microstep_error": "microstep",
    "friction_ripple": "motor order",
    "friction_warmup": "warm-up",
    "motor_stribeck": "friction",
    "motor_asymmetry": "friction",
    "motor_drag": "viscous",
    "motor_dahl": "friction",
    "kinematic_error": "transmission error",
    "backlash": "backlash",
    "stiffness_hardening": "stiffness",
    "transmission_hysteresis": "hysteresis",
    "joint_viscous": "viscous",
    "asymmetric_viscous": "viscous",
    "coulomb": "friction",
    "asymmetric_coulomb": "friction",
    "load_friction": "friction",
    "stribeck": "friction",
    "dahl": "friction",
    "lugre": "friction",
    "harness": "harness",
    "joint_hysteresis": "hysteresis",
    "joint_order": "local torque",
    "local_torque": "local torque",
    "detent": "local torque",
    "ground_cable": "cable",
    "ground_bump": "local torque",
    "mass_shift": "mass",
    "air_drag": "air drag",
    "appendage": "appendage",
    "bungee": "bungee",
    "tether": "cable",
    "floor_vibration": "vibration",
    "floor_tilt": "tilt",
    "base_hardening": "stiffness",
    "base_hysteresis": "hysteresis",
    "channel_gain": "gain",
    "cross_coupling": "cross-coupling",
    "channel_interaction": "product",
    "channel_nonlinearity": "non-linearity",
    "channel_s_shape": "non-linearity",
    "channel_step": "converter",
    "channel_hysteresis": "sensor hysteresis",
    "channel_play": "sensor hysteresis",
    "channel_lag": "lag",
    "drift_linear": "drift",
    "drift_exponential": "drift",
    "drift_temperature": "drift",
    "mains": "mains",
    "encoder_eccentricity": "eccentricity",
    "encoder_interpolation": "converter",
    "encoder_switching": "converter",
    "encoder_step": "converter",
    "encoder_quantisation": "quantisation",
    "encoder_hysteresis": "sensor hysteresis",
    "encoder_profile": UNNAMED,
    "clock_offset": "offset",
    "clock_skew": "skew",
    "clock_warmup": "skew",
    "clock_drops": "drops",
    "clock_wander": "wander",
    "controller_gain": "gain",
    "controller_jitter": "jitter",
    "controller_lag": "latency",
    "controller_latency": "latency",
}


def family(name: str) -> str:
    """Return the family of a law of the catalogue."""
    return FAMILIES[name]


def port_word(name: str, port: Port | SensingPort) -> str:
    """Return the word for the port of a law."""
    return _APART.get(name, PORTS[port])
