"""The drives' physics, compiled: one real-time cycle of motors and gearboxes around MuJoCo's rigid bodies.

Time stepping is the leapfrog that MuJoCo's semi-implicit Euler step is: velocities at t_n, positions and
forces at t_n + dt/2. Every force that changes abruptly is taken as its mean over the step:

- the field's microsteps by the time that each of them lasts within the step,
- the edges of a stiction zone by the part of the step that lies within.

Friction is implicit (Moreau): the rate at the end of the step solves

    Jr (w1 - w0)/dt = T - b_m (w0 + w1)/2 - c clip((w0 + w1)/2 / w_dyn, -1, 1) - tau,  tau in Ts0 Sgn(w1)

exactly, case by case: it slides forwards, it slides backwards, or it sticks (w1 = 0) and tau is
whatever holds it. No regularisation, no threshold speed.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from engine.hardware import Hardware
from engine.ports import BODY, OUT, disturb

_STEPS = 200  # electrical and tooth cycles: T_cog and T_stat repeat 200 times a motor turn
_ELECTRICAL = np.pi / 64  # electrical angle of a microstep, rad


class DriveNumbers(NamedTuple):
    """One axis's motor and gearbox, SI, in the symbols of the drive equations."""

    Jr: float
    R: float
    microsteps: float  # a motor turn
    Tmax: float
    Kangle: float
    tcog: float
    phi_cog: float
    b_m: float
    d0: float
    d1: float
    phi_dyn: float
    w_dyn: float
    Ts0: float
    delta: float
    phi_stat: float
    fsv: float
    Ka: float
    kinematic_sin: float = 0.0
    kinematic_cos: float = 0.0
    kinematic_order: float = 2.0  # periods in a turn of the wave generator


def drive_numbers(hardware: Hardware, axis: str) -> DriveNumbers:
    """Collect the numbers of one axis's drive."""
    named = {"Jr": "rotor_inertia", "R": "ratio", "microsteps": "steps_per_turn"}
    places = {field: f"joint.{axis}.drive.{named.get(field, field)}" for field in DriveNumbers._fields}
    given = {field: hardware.scalar(place) for field, place in places.items() if place in hardware.values}
    return DriveNumbers(**given)


@njit(error_model="numpy")
def motor_torque(p: DriveNumbers, th_r: float, field_0: float, field_1: float) -> float:
    """Mean of Tmax sin(pi/64 NN - Kangle th_r) while the field moves from field_0 to field_1, N m.

    Field in motor rad; NN is the whole microstep nearest to the field at every instant.
    """
    x0 = field_0 * p.microsteps / (2 * np.pi)
    x1 = field_1 * p.microsteps / (2 * np.pi)
    low, high = min(x0, x1), max(x0, x1)
    first, last = np.floor(low + 0.5), np.floor(high + 0.5)
    if first == last:
        return p.Tmax * np.sin(_ELECTRICAL * first - p.Kangle * th_r)
    total = 0.0
    for k in range(int(last - first) + 1):
        NN = first + k
        lasts = min(high, NN + 0.5) - max(low, NN - 0.5)
        total += lasts * np.sin(_ELECTRICAL * NN - p.Kangle * th_r)
    return p.Tmax * total / (high - low)


@njit(error_model="numpy")
def gear_error(p: DriveNumbers, th_r: float) -> tuple[float, float]:
    """What the output turns beyond th_r / R, rad, and its slope: phi = th_r / R + amplitude sin(n th_r + phase)."""
    amplitude = np.hypot(p.kinematic_sin, p.kinematic_cos)
    angle = p.kinematic_order * th_r + np.arctan2(p.kinematic_cos, p.kinematic_sin)
    return amplitude * np.sin(angle), amplitude * p.kinematic_order * np.cos(angle)


@njit(error_model="numpy")
def stiction_level(p: DriveNumbers, th_r: float, w: float, dt: float) -> float:
    """Mean over the step of the Coulomb torque's level: Ts0 inside a tooth's zone, else 0, N m."""
    phase = _STEPS * th_r + p.phi_stat
    distance = p.delta - abs(phase - 2 * np.pi * np.round(phase / (2 * np.pi)))
    width = max(_STEPS * abs(w) * dt, 1e-12)
    return p.Ts0 * min(max(distance / width + 0.5, 0.0), 1.0)


@njit(error_model="numpy")
def _sliding_rate(p: DriveNumbers, rhs: float, w0: float, c: float, h: float) -> float:
    """Solve w1 + h (b_m (w0 + w1)/2 + c clip((w0 + w1)/2 / w_dyn, -1, 1)) = rhs for w1, rad/s."""
    b = 0.5 * h * p.b_m
    s = 0.5 * h * c / p.w_dyn
    w1 = (rhs - (b + s) * w0) / (1 + b + s)
    mean = 0.5 * (w0 + w1)
    if abs(mean) <= p.w_dyn:
        return w1
    return (rhs - b * w0 - h * c * np.sign(mean)) / (1 + b)


@njit(error_model="numpy")
def friction_torque(p: DriveNumbers, T: float, th_r: float, w0: float, dt: float, loss: float = 0.0) -> float:
    """Return T_motf + T_dyn + T_stat over one step, given the torque T of everything else, N m.

    T may fall with the rate, by `loss` N m s/rad; what it has lost at the step's end is returned with the friction.
    """
    h = dt / (p.Jr + loss * dt)
    c = p.d0 + p.d1 * np.sin(2 * th_r + p.phi_dyn)
    level = stiction_level(p, th_r, w0, dt)
    free = w0 + h * T
    w1 = 0.0
    forwards = _sliding_rate(p, free - h * level, w0, c, h)
    if forwards > 0:
        w1 = forwards
    else:
        backwards = _sliding_rate(p, free + h * level, w0, c, h)
        if backwards < 0:
            w1 = backwards
    return (free - w1) / h + loss * (w1 - w0)


@njit(error_model="numpy")
def bungee_force(cord: tuple[float, float, float, float, float], at: Any, force: Any) -> None:
    """Write into `force` what a cord (anchor x, y, z, stiffness, free length) pulls at a point with, N."""
    x, y, z = cord[0] - at[0], cord[1] - at[1], cord[2] - at[2]
    length = np.sqrt(x * x + y * y + z * z)
    tension = cord[3] * max(length - cord[4], 0.0)
    force[0], force[1], force[2] = tension * x / length, tension * y / length, tension * z / length


@njit(error_model="numpy")
def pull_at(cord: tuple[float, float, float, float, float], hook: Any, centre: Any, wrench: Any) -> None:
    """Add to `wrench` (force, then torque about `centre`) what a cord pulls at `hook` with."""
    force = np.zeros(3)
    bungee_force(cord, hook, force)
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        wrench[k] += force[k]
        wrench[3 + k] += (hook[i] - centre[i]) * force[j] - (hook[j] - centre[j]) * force[i]


@njit(error_model="numpy")
def copy_bodies(view: Any, bodies: Any) -> None:
    """Fill `bodies` (2, 21) from views of MuJoCo's own xpos, xmat, xipos and cacc, in its c-frame, about `com`."""
    for row in range(2):
        origin, axes, centre, cacc = view[4 * row], view[4 * row + 1], view[4 * row + 2], view[4 * row + 3]
        com = view[8]
        for k in range(3):
            bodies[row, k] = origin[k]
            bodies[row, 12 + k] = centre[k]
            bodies[row, 18 + k] = cacc[k]
        for k in range(9):
            bodies[row, 3 + k] = axes[k]
        r0, r1, r2 = origin[0] - com[0], origin[1] - com[1], origin[2] - com[2]
        bodies[row, 15] = cacc[3] + cacc[1] * r2 - cacc[2] * r1
        bodies[row, 16] = cacc[4] + cacc[2] * r0 - cacc[0] * r2
        bodies[row, 17] = cacc[5] + cacc[0] * r1 - cacc[1] * r0


@njit(error_model="numpy")
def run_cycle(
    mj_step: Any, model: int, data: int, state: Any, az: DriveNumbers, el: DriveNumbers, cord: Any,
    field: Any, dt: float, wrench: Any, q: Any, act: Any, acts: bool, extra: Any, start: float,
) -> None:  # fmt: skip
    """Integrate one real-time cycle while each field moves linearly from field[0] to field[1].

    `state` holds views of MuJoCo's own qpos, qvel, qacc, qfrc_applied, sensordata, the antenna's xipos
    and its row of xfrc_applied. Row n of `wrench` (n, 6) and `q` (n, 7) belongs to t = start + (n + 1/2) dt.
    `act` and `extra` are what acts beyond the drives (engine.ports): its numbers and memory, the azimuth
    body's row of xfrc_applied, MuJoCo's gravity, gravity at rest, what `copy_bodies` reads, and the disturbance.
    """
    qpos, qvel, qacc, qfrc, sensor, xipos, xfrc, hook = state
    numbers, memory, xfrc_azimuth, gravity, still, view, disturbance = extra
    motion, bodies, out = np.zeros((3, 7)), np.zeros((2, BODY)), np.zeros(OUT)
    steps = len(wrench)
    rates = np.zeros(2)
    for axis in range(2):
        rates[axis] = (field[1, axis] - field[0, axis]) / ((az.R if axis == 0 else el.R) * steps * dt)
    for n in range(steps):
        if acts:
            for k in range(7):
                motion[0, k] = qpos[k]
                motion[1, k] = qvel[k] if k == 3 or k == 5 else qvel[k] + 0.5 * dt * qacc[k]
            for axis in range(2):
                motion[2, axis] = field[0, axis] + (field[1, axis] - field[0, axis]) * ((n + 0.5) / steps)
            copy_bodies(view, bodies)
            out[:] = 0.0
            act(start + (n + 0.5) * dt, dt, numbers, memory, motion, bodies, out)
            if len(disturbance) > 0:
                disturb(disturbance, start + (n + 0.5) * dt, rates, out)
            for k in range(3):
                qfrc[k] = out[k]
                gravity[k] = still[k] - out[19 + k]
            for k in range(6):
                xfrc_azimuth[k] = out[7 + k]
                xfrc[k] = out[13 + k]
        for axis in range(2):
            p = az if axis == 0 else el
            rotor = 3 + 2 * axis
            th_r, th_l = qpos[rotor], qpos[rotor + 1]
            w_r = qvel[rotor] + 0.5 * dt * qacc[rotor]
            w_l = qvel[rotor + 1] + 0.5 * dt * qacc[rotor + 1]
            beyond, slope = gear_error(p, th_r)
            T_gear = p.fsv * (w_r / p.R + slope * w_r - w_l) + p.Ka * (th_r / p.R + beyond - th_l)
            travel = field[1, axis] - field[0, axis]
            T = motor_torque(
                p, th_r, field[0, axis] + travel * (n / steps), field[0, axis] + travel * ((n + 1) / steps)
            )
            T += p.tcog * np.sin(_STEPS * th_r + p.phi_cog) - T_gear / p.R
            T -= T_gear * slope  # virtual work: the rotor turns the output by 1/R + slope
            if acts:
                T += out[rotor]
            qfrc[rotor] = T - friction_torque(p, T, th_r, qvel[rotor], dt, out[22 + axis])
            qfrc[rotor + 1] = T_gear
            if acts:
                qfrc[rotor + 1] += out[rotor + 1]
        if cord[3] > 0:
            if not acts:
                xfrc[:] = 0.0
            pull_at(cord, hook, xipos, xfrc)
        q[n] = qpos
        mj_step(model, data)
        for channel in range(6):
            wrench[n, channel] = -sensor[channel]
