"""Noise-free simulation: commands in; wrench after the amplifier, encoder angles and field out."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.optimize import root
from scipy.signal import butter, sosfilt, sosfilt_zi

from engine.drive import copy_bodies, drive_numbers, gear_error, motor_torque, pull_at, run_cycle
from engine.hardware import AXES, Array, Hardware
from engine.ports import BODY, GENERALISED, NONE, ON_ANTENNA, ON_AZIMUTH, OUT, Extra
from engine.rigid import AZ, EL, HOOK, PLATE, ROTOR_AZ, ROTOR_EL, RigidModel, build, mj_step_function
from engine.trajectories import Commands

# s; halving it moves no channel by a tenth of its noise (tests/engine/test_engine_convergence.py).
TIME_STEP = 1e-4

_RATE_SPAN = 5e-3  # s, each way: the rates that an encoder's error depends on


@dataclass(frozen=True, slots=True, eq=False)
class Result:
    """What perfect sensors behind the amplifier would have recorded."""

    t: Array  # (n,) s, instants of the wrench and of the encoders
    wrench: Array  # (n, 6) N and N m, on the transducer, in the plate's axes, after the amplifier
    angles: Array  # (n, 2) rad, true joint angles az, el
    encoder: Array  # (n, 2) rad, as the encoders code them: offset added, rounded
    rotors: Array  # (n, 2) rad, rotor angles with respect to their carriers
    plate: Array  # (n, 3) rad, rotation of the transducer's top plate
    field_t: Array  # (m,) s, starts of the real-time cycles
    field: Array  # (m, 2) motor rad, field positions then


@dataclass(frozen=True, slots=True, eq=False)
class Dense:
    """The same at the integrator's own steps, t = (k + 1/2) dt, the wrench before the amplifier."""

    t: Array  # (k,)
    wrench: Array  # (k, 6)
    q: Array  # (k, 7): plate x, y, z, rotor az, az, rotor el, el
    field_t: Array
    field: Array


def simulate(
    hardware: Hardware, commands: Commands, *, rate_hz: float = 100.0, time_step: float = TIME_STEP, extra: Extra = NONE
) -> Result:
    """Drive `hardware` along `commands`; sample wrench and encoders at `rate_hz` without noise.

    The run starts at rest in static equilibrium at the first commanded angles and lasts until the
    last command. `extra` acts beyond the engine's own physics (engine.ports); what it does to the
    transducer's reading and to clocks is the recorder's.
    """
    dense = integrate(hardware, commands, time_step=time_step, extra=extra)
    t = np.arange(0.0, dense.field_t[-1] + 1e-9, 1.0 / rate_hz)
    return sample(hardware, dense, t, t, extra=extra)


def sample(hardware: Hardware, dense: Dense, wrench_t: Array, angle_t: Array, *, extra: Extra = NONE) -> Result:
    """Read the sensors at instants of their own: the wrench behind its amplifier, the angles at once."""
    q = at(dense.t, dense.q, angle_t)
    angles = q[:, [AZ, EL]]
    shown = angles
    if extra.encoder is not None:
        before = at(dense.t, dense.q[:, [AZ, EL]], angle_t - _RATE_SPAN)
        after = at(dense.t, dense.q[:, [AZ, EL]], angle_t + _RATE_SPAN)
        shown = angles + extra.encoder(angle_t, angles, (after - before) / (2 * _RATE_SPAN))
    return Result(
        t=wrench_t,
        wrench=at(dense.t, amplify(hardware, dense), wrench_t),
        angles=angles,
        encoder=encode(hardware, shown),
        rotors=q[:, [ROTOR_AZ, ROTOR_EL]],
        plate=q[:, PLATE],
        field_t=dense.field_t,
        field=dense.field,
    )


def integrate(
    hardware: Hardware,
    commands: Commands,
    *,
    time_step: float = TIME_STEP,
    extra: Extra = NONE,
    field: Array | None = None,
) -> Dense:
    """Run the controller, the drives and the rigid bodies from the first command to the last.

    With a `field` (cycles + 1, 2), motor rad at the cycles' starts, the drives follow it in place of the controller.
    """
    cycle = hardware.scalar("controller.cycle")
    steps = round(cycle / time_step)
    dt = cycle / steps
    cycles = len(commands.t) - 1
    az, el = (drive_numbers(hardware, axis) for axis in AXES)
    ratio = np.array([az.R, el.R])

    rigid = build(hardware, dt)
    commanded = np.empty((cycles + 1, 2))
    first = commands.position[0] if field is None else field[0] / ratio
    commanded[0] = ratio * first
    applied = np.tile(commanded[0], (2, 1))  # where the motors' fields are at a cycle's start and end
    data = rigid.data
    data.qpos[:] = equilibrium(hardware, rigid, first, extra)
    state = (
        data.qpos, data.qvel, data.qacc, data.qfrc_applied, data.sensordata,
        data.xipos[rigid.antenna], data.xfrc_applied[rigid.antenna], _hook(hardware, rigid),
    )  # fmt: skip
    gravity = rigid.model.opt.gravity
    memory = np.zeros((len(extra.numbers), extra.states))
    more = (
        extra.numbers, memory, data.xfrc_applied[rigid.azimuth], gravity, gravity.copy(), _view(rigid),
        extra.disturbance,
    )  # fmt: skip
    addresses = rigid.model._address, data._address
    cord = _cord(hardware)
    step = mj_step_function()

    q = np.empty((cycles * steps, 7))
    wrench = np.empty((cycles * steps, 6))
    codes = np.empty((cycles, 2))
    error_sum = np.zeros(2)
    for k in range(cycles):
        now = data.qpos - 0.5 * dt * data.qvel  # positions are half a step ahead
        shown = now[[AZ, EL]]
        if extra.encoder is not None:
            rates = data.qvel[[AZ, EL]]
            shown = shown + extra.encoder(np.array([k * cycle]), shown[None], rates[None])[0]
        codes[k] = encode(hardware, shown)
        if field is not None:
            commanded[k + 1] = field[k + 1]
        elif hardware.loop == "open":
            commanded[k + 1] = ratio * commands.position[k + 1]
        else:
            error = commands.position[k] - codes[max(k - hardware.latency, 0)]
            error_sum += error
            correction = hardware["controller.Kp"] * error + hardware["controller.Ki"] * cycle * error_sum
            commanded[k + 1] = commanded[k] + ratio * (commands.rate[k] * cycle + correction)
        applied[0], applied[1] = applied[1], commanded[k + 1]
        if extra.drive is not None:
            applied[1] += extra.drive(k, commanded[k], commanded[k + 1])
        rows = slice(k * steps, (k + 1) * steps)
        run_cycle(
            step, *addresses, state, az, el, cord, applied, dt, wrench[rows], q[rows],
            extra.act, extra.acts, more, k * cycle,
        )  # fmt: skip
    if not np.all(np.isfinite(q)):
        raise FloatingPointError("the simulation diverged")
    t = (np.arange(cycles * steps) + 0.5) * dt
    return Dense(t, wrench, q, cycle * np.arange(cycles + 1), commanded)


def equilibrium(hardware: Hardware, rigid: RigidModel, angles: Array, extra: Extra = NONE) -> Array:
    """Generalised positions at rest under gravity (and bungee), field at R times `angles`, no friction.

    Shape (7,). Solved to 1e-12 N m on every coordinate; leaves MuJoCo's data at that state.
    """
    drives = [drive_numbers(hardware, axis) for axis in AXES]
    cord = _cord(hardware)
    data = rigid.data
    memory = np.zeros((len(extra.numbers), extra.states))
    motion, bodies, out = np.zeros((3, 7)), np.zeros((2, BODY)), np.zeros(OUT)
    motion[2, :2] = [p.R * angle for p, angle in zip(drives, angles, strict=True)]

    def unbalanced(q: Array) -> Array:
        data.qpos[:] = q
        data.qvel[:] = 0
        data.qfrc_applied[:] = 0
        data.xfrc_applied[:] = 0
        mujoco.mj_kinematics(rigid.model, data)
        if cord[3] > 0:
            centre = data.xipos[rigid.antenna]
            pull_at(cord, _hook(hardware, rigid), centre, data.xfrc_applied[rigid.antenna])
        for axis, p in enumerate(drives):
            rotor = 3 + 2 * axis
            beyond, slope = gear_error(p, q[rotor])
            T_gear = p.Ka * (q[rotor] / p.R + beyond - q[rotor + 1])
            T = motor_torque(p, q[rotor], p.R * angles[axis], p.R * angles[axis])
            data.qfrc_applied[rotor] = T + p.tcog * np.sin(200 * q[rotor] + p.phi_cog) - T_gear / p.R - T_gear * slope
            data.qfrc_applied[rotor + 1] = T_gear
        if extra.acts:
            motion[0] = q
            copy_bodies(_view(rigid), bodies)
            bodies[:, 15:18] = -rigid.model.opt.gravity  # at rest
            bodies[:, 18:] = 0.0
            out[:] = 0.0
            extra.act(0.0, 0.0, extra.numbers, memory, motion, bodies, out)
            data.qfrc_applied[:] += out[GENERALISED]
            data.xfrc_applied[rigid.azimuth] += out[ON_AZIMUTH]
            data.xfrc_applied[rigid.antenna] += out[ON_ANTENNA]
        mujoco.mj_forward(rigid.model, data)
        force = np.zeros(7)
        mujoco.mj_mulM(rigid.model, data, force, data.qacc)
        return force

    start = np.array([0, 0, 0, drives[0].R * angles[0], angles[0], drives[1].R * angles[1], angles[1]])
    # Torques on rotors are 1e-4 of those on the plate: scaled, all count alike.
    scale = np.array([1, 1, 1, drives[0].R, 1, drives[1].R, 1])
    solution = root(lambda x: unbalanced(x * scale) * scale, start / scale, tol=1e-14)
    residual = unbalanced(solution.x * scale)
    if np.max(np.abs(residual)) > 1e-9:
        raise FloatingPointError(f"no static equilibrium at {angles}: {residual} N m are left")
    data.qacc[:] = 0
    return solution.x * scale


def _view(rigid: RigidModel) -> tuple[Array, ...]:
    """MuJoCo's own memory that `copy_bodies` reads."""
    data = rigid.data
    rows: list[Array] = []
    for body in (rigid.azimuth, rigid.antenna):
        rows += [data.xpos[body], data.xmat[body], data.xipos[body], data.cacc[body]]
    return (*rows, data.subtree_com[rigid.base])


def amplify(hardware: Hardware, dense: Dense) -> Array:
    """Low-pass the wrench as the transducer's amplifier does (Butterworth), settled at the start."""
    rate = 1.0 / (dense.t[1] - dense.t[0])
    sos = butter(hardware.amplifier_order, hardware.scalar("transducer.amplifier.corner"), fs=rate, output="sos")
    start = sosfilt_zi(sos)[:, :, None] * dense.wrench[0]
    amplified, _ = sosfilt(sos, dense.wrench, axis=0, zi=start)
    return np.asarray(amplified)


def encode(hardware: Hardware, angles: Array) -> Array:
    """Return what the encoders read at `angles` (..., 2): round((angle + offset)/step) step, rad."""
    offset = np.array([hardware.scalar(f"joint.{axis}.encoder.offset") for axis in AXES])
    step = np.array([hardware.scalar(f"joint.{axis}.encoder.step") for axis in AXES])
    shifted = angles + offset
    return np.where(step > 0, np.round(shifted / np.where(step > 0, step, 1.0)) * step, shifted)


def at(t: Array, values: Array, instants: Array) -> Array:
    """Interpolate columns linearly; the step is 1/500 of the amplifier's fastest period."""
    return np.column_stack([np.interp(instants, t, column) for column in values.T])


def _hook(hardware: Hardware, rigid: RigidModel) -> Array:
    """Where a cord pulls at the antenna: a view of MuJoCo's own numbers."""
    if hardware.bungee is None or hardware.bungee.hook is None:
        return rigid.data.xipos[rigid.antenna]
    return rigid.data.site_xpos[rigid.model.site(HOOK).id]


def _cord(hardware: Hardware) -> tuple[float, float, float, float, float]:
    if hardware.bungee is None:
        return (0.0, 0.0, 0.0, 0.0, 0.0)
    return (*hardware.bungee.anchor, hardware.bungee.stiffness, hardware.bungee.free_length)
