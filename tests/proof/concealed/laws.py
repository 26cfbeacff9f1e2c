"""Laws of concealed physics on the mechanism, compiled: what acts at the engine's ports in one step.

What stands for friction, hysteresis, backlash and springs has other formulas than a plant's catalogue: friction is
smooth or elastoplastic, hysteresis is Bouc-Wen's or a sum of stops, backlash has rounded corners and compliance,
springs are exponential. Drag of the air, creep, tilt and tones are what they are in any engine. Each row of `numbers`
is one effect: law, axis (0 az, 1 el), amplitude, R, Ka, fsv, Tmax, Kangle, then shapes from SHAPES on. SI.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Any

import numpy as np
from numba import njit

SHAPES = 8
COLUMNS = 20
STATES = 6


class Law(IntEnum):
    """Laws by number; `s` are shapes, `A` the amplitude, th and w angle and rate, x = th_r/R - th_l."""

    STRIBECK = 10  # -A (S(w/s0) + s1 S(w/s0) exp(-|w/s2|)), S a sigmoid (tanh, or algebraic where s3 > 0.5)
    ELASTOPLASTIC = 11  # -A z/s0; dz/dt = w (1 - a(z) sgn(w) z/s0), a rising smoothly from 0 at |z| = 0.6 s0 to 1 at s0
    TOOTH_SHAPE = 12  # A sin(u)/(1 + s1 cos u), u = 200 s0 th + s2
    MOTOR_ORDER = 13  # A sin(u + s1 sin u), u = s0 th + s2
    ODD_POWER = 14  # -A (w/s0)^3, bent off beyond 3 s0, where only vibration gets
    MICROSTEP = 15  # Tmax (sin(e + A sin(s0 Kangle th_f + s1)) - sin e), e = Kangle (th_f - th_r)
    WARM_UP = 16  # -A S(w/s0) / (1 + t/s1)^2
    RUB = 17  # -A S(w/s0) exp(s2 (cos(th - s1) - 1))
    CROSS_AXIS = 18  # -A S(w/s0) |w_other|/(|w_other| + s1)
    SAWTOOTH = 19  # A atan(s2 tan((s0 th + s1)/2))/atan(s2), continuous
    TRANSMISSION_ERROR = 20  # angle A asin(s2 sin u)/asin(s2), u = s0 th_r + s1: a rounded triangle
    BACKLASH = 21  # gear's stiffness less s1 of itself within |x - s2| < A, corners rounded over s0
    STIFFENING = 22  # A s0 Ka (sinh(x/s0) - x/s0)
    BOUC_WEN = 23  # A z/s0; dz/dt = dx/dt (1 - |z/s0|^s1 (1/2 + 1/2 sgn(z dx/dt)))
    HARNESS = 30  # -A sinh((th - s0)/s1)
    STOPS = 31  # -A mean of stops z_i/r_i of travel r_i = s0 (1, 2, 4)
    BEARING = 32  # -A S(w/s0)
    BUMP = 33  # A v (1 - v^2)^2 within |v| < 1, v = (th - s0)/s1
    JOINT_SAWTOOTH = 34  # A saw(s0 th + s1), as SAWTOOTH
    CABLE = 40  # -A S((th - s0)/s1) about the azimuth body's axis, from the laboratory
    CABLE_BOUC_WEN = 41  # -A z/s0 likewise
    CORD = 42  # tension A ln(L/s0) where L > s0, from the antenna's point s4..6 to the anchor s1..3
    AIR = 43  # -A |v|^0.8 v at the antenna's point s0..2, which turns with plate and joints
    SHIFTING_MASS = 50  # static moment A S(f/s0) along the antenna's axis s1, f the specific force along that axis in g
    FLOOR_VIBRATION = 60  # acceleration A sin(2 pi (s0 t + s1 t^2) + s2) along s3..5
    PLATE_STIFFENING = 61  # -A s1 (sinh((phi)/s1) - phi/s1) on the plate's axis s0
    PLATE_STOPS = 62  # -A mean of stops on the plate's axis s0, travels s1 (1, 2, 4)
    FLOOR_TILT = 63  # tilt A (1 - exp(-t/s0)) about the horizontal direction s1 (rad)
    APPENDAGE = 70  # mass A on a spring, s0 Hz, damping s1, along s2..4 at the antenna's point s5..7


@njit(error_model="numpy", cache=True)
def sigmoid(x: float, algebraic: float) -> float:
    """Odd, from -1 to 1, slope 1 at 0."""
    return x / np.sqrt(1.0 + x * x) if algebraic > 0.5 else np.tanh(x)


@njit(error_model="numpy", cache=True)
def _sawtooth(u: float, sharp: float) -> float:
    """Odd in u, period 2 pi; the sharper, the steeper its falling edge."""
    s, c = np.sin(0.5 * u), np.cos(0.5 * u)
    return np.arctan(sharp * s * c / (c * c + 1e-3)) / np.arctan(0.5 * sharp * 31.6)


@njit(error_model="numpy", cache=True)
def _stops(z: Any, travel: float, change: float) -> float:
    """Move three stops of travels 1, 2, 4 times `travel`; return their mean, each from -1 to 1."""
    total = 0.0
    for k in range(3):
        r = travel * 2.0**k
        z[k] = min(max(z[k] + change, -r), r)
        total += z[k] / r
    return total / 3.0


@njit(error_model="numpy", cache=True)
def _sliding(p: Any, t: float, th: float, w: float, w_other: float) -> tuple[float, float]:
    """Friction of the sigmoid kind on a rotor, N m, and what it loses with the rate, N m s/rad."""
    law, s, level = int(p[0]), p[SHAPES:], p[2]
    if law == Law.STRIBECK:
        level *= 1.0 + s[1] * np.exp(-abs(w) / s[2])
    elif law == Law.WARM_UP:
        level /= (1.0 + t / s[1]) ** 2
    elif law == Law.RUB:
        level *= np.exp(s[2] * (np.cos(th - s[1]) - 1.0))
    else:
        level *= abs(w_other) / (abs(w_other) + s[1])
    x = w / s[0]
    slope = (1.0 + x * x) ** -1.5 if s[3] > 0.5 else 1.0 - np.tanh(x) ** 2
    return -level * sigmoid(x, s[3]), level * slope / s[0]


@njit(error_model="numpy", cache=True)
def _motor(p: Any, z: Any, dt: float, th: float, w: float, field: float) -> float:
    """Any other torque on a rotor, N m."""
    law, A, s = int(p[0]), p[2], p[SHAPES:]
    if law == Law.ELASTOPLASTIC:
        z0, r = s[0], z[0] / s[0]
        if r * w > 0:
            v = min(max((abs(r) - 0.6) / 0.4, 0.0), 1.0)
            z[0] += dt * w * (1.0 - v * v * (3.0 - 2.0 * v) * abs(r))
        else:
            z[0] += dt * w
        z[0] = min(max(z[0], -z0), z0)
        return -A * z[0] / z0
    if law == Law.TOOTH_SHAPE:
        u = 200.0 * s[0] * th + s[2]
        return A * np.sin(u) / (1.0 + s[1] * np.cos(u))
    if law == Law.MOTOR_ORDER:
        u = s[0] * th + s[2]
        return A * np.sin(u + s[1] * np.sin(u))
    if law == Law.ODD_POWER:
        u = w / s[0]
        return -A * u**3 / (1.0 + abs(u) ** 3 / 27.0)
    if law == Law.MICROSTEP:
        e = p[7] * (field - th)
        return p[6] * (np.sin(e + A * np.sin(s[0] * p[7] * field + s[1])) - np.sin(e))
    if law == Law.SAWTOOTH:
        return A * _sawtooth(s[0] * th + s[1], s[2])
    return 0.0


@njit(error_model="numpy", cache=True)
def _transmission(p: Any, z: Any, dt: float, x: float, v: float, th: float, w: float) -> tuple[float, float]:
    """Torque on the output beside the gear's own, N m, and change of the ratio, rad/rad, that the rotor feels."""
    law, A, s, Ka, fsv = int(p[0]), p[2], p[SHAPES:], p[4], p[5]
    if law == Law.TRANSMISSION_ERROR:
        u, most = s[0] * th + s[1], np.arcsin(s[2])
        error = A * np.arcsin(s[2] * np.sin(u)) / most
        slope = A * s[0] * s[2] * np.cos(u) / np.sqrt(1.0 - (s[2] * np.sin(u)) ** 2) / most
        return Ka * error + fsv * slope * w, slope
    if law == Law.BACKLASH:
        u = x - s[2]
        soft = 0.5 * (np.sqrt((u + A) ** 2 + s[0] ** 2) - np.sqrt((u - A) ** 2 + s[0] ** 2))
        rest = 0.5 * (np.sqrt((A - s[2]) ** 2 + s[0] ** 2) - np.sqrt((s[2] + A) ** 2 + s[0] ** 2))
        return -Ka * s[1] * (soft - rest), 0.0
    if law == Law.STIFFENING:
        return A * s[0] * Ka * (np.sinh(x / s[0]) - x / s[0]), 0.0
    if law == Law.BOUC_WEN:
        return A * _bouc_wen(z, dt * v, s[0], s[1]), 0.0
    return 0.0, 0.0


@njit(error_model="numpy", cache=True)
def _bouc_wen(z: Any, change: float, width: float, power: float) -> float:
    """Move Bouc-Wen's state by a change of its coordinate; return z/width."""
    r = z[0] / width
    if r * change > 0:
        z[0] += change * (1.0 - min(abs(r), 1.0) ** power)
    else:
        z[0] += change
    return z[0] / width


@njit(error_model="numpy", cache=True)
def _joint(p: Any, z: Any, dt: float, th: float, w: float) -> float:
    """Torque on an output joint, reacted by its carrier, N m."""
    law, A, s = int(p[0]), p[2], p[SHAPES:]
    if law == Law.HARNESS:
        return -A * np.sinh((th - s[0]) / s[1])
    if law == Law.STOPS:
        return -A * _stops(z, s[0], dt * w)
    if law == Law.BEARING:
        return -A * sigmoid(w / s[0], s[3])
    if law == Law.BUMP:
        v = (th - s[0]) / s[1]
        return A * v * (1.0 - v * v) ** 2 if abs(v) < 1.0 else 0.0
    if law == Law.JOINT_SAWTOOTH:
        return A * _sawtooth(s[0] * th + s[1], s[2])
    return 0.0


@njit(error_model="numpy", cache=True)
def _point(body: Any, r0: float, r1: float, r2: float, out: Any) -> None:
    """Write a point fixed to a body, from the body's origin, in undeflected T's axes."""
    for k in range(3):
        out[k] = body[3 + 3 * k] * r0 + body[4 + 3 * k] * r1 + body[5 + 3 * k] * r2


@njit(error_model="numpy", cache=True)
def _push(body: Any, arm: Any, force: Any, out: Any) -> None:
    """Add a force at origin + arm to a body's six loads about its centre of mass."""
    x, y, z = arm[0] + body[0] - body[12], arm[1] + body[1] - body[13], arm[2] + body[2] - body[14]
    for k in range(3):
        out[k] += force[k]
    out[3] += y * force[2] - z * force[1]
    out[4] += z * force[0] - x * force[2]
    out[5] += x * force[1] - y * force[0]


@njit(error_model="numpy", cache=True)
def _ground(p: Any, z: Any, dt: float, motion: Any, bodies: Any, out: Any) -> None:
    """Wrench from the laboratory on the azimuth body or on the antenna."""
    law, A, s = int(p[0]), p[2], p[SHAPES:]
    arm, force = np.zeros(3), np.zeros(3)
    if law in (Law.CABLE, Law.CABLE_BOUC_WEN):
        if law == Law.CABLE:
            torque = -A * (sigmoid((motion[0, 4] - s[0]) / s[1], s[3]) + sigmoid(s[0] / s[1], s[3]))
        else:
            torque = -A * _bouc_wen(z, dt * motion[1, 4], s[0], s[1])
        for k in range(3):
            out[10 + k] += torque * bodies[0, 5 + 3 * k]
    elif law == Law.CORD:
        _point(bodies[1], s[4], s[5], s[6], arm)
        length = 0.0
        for k in range(3):
            force[k] = s[1 + k] - bodies[1, k] - arm[k]
            length += force[k] ** 2
        length = np.sqrt(length)
        tension = A * np.log(max(length / s[0], 1.0))
        for k in range(3):
            force[k] *= tension / length
        _push(bodies[1], arm, force, out[13:19])
    elif law == Law.AIR:
        _point(bodies[1], s[0], s[1], s[2], arm)
        w = np.zeros(3)
        for k in range(3):
            w[k] = motion[1, 4] * bodies[0, 5 + 3 * k] - motion[1, 6] * bodies[0, 4 + 3 * k]
        # The plate's vibration is as fast as a slow motion; it turns about T's origin.
        x, y, z_ = arm[0] + bodies[1, 0], arm[1] + bodies[1, 1], arm[2] + bodies[1, 2]
        v0, v1, v2 = (
            w[1] * arm[2] - w[2] * arm[1] + motion[1, 1] * z_ - motion[1, 2] * y,
            w[2] * arm[0] - w[0] * arm[2] + motion[1, 2] * x - motion[1, 0] * z_,
            w[0] * arm[1] - w[1] * arm[0] + motion[1, 0] * y - motion[1, 1] * x,
        )
        speed = np.sqrt(v0 * v0 + v1 * v1 + v2 * v2)
        force[0], force[1], force[2] = -A * speed**0.8 * v0, -A * speed**0.8 * v1, -A * speed**0.8 * v2
        _push(bodies[1], arm, force, out[13:19])


@njit(error_model="numpy", cache=True)
def _structure(p: Any, z: Any, t: float, dt: float, motion: Any, bodies: Any, out: Any) -> None:
    """Masses that move, appendages, the plate's springs and the floor."""
    law, A, s = int(p[0]), p[2], p[SHAPES:]
    body = bodies[1]
    if law == Law.SHIFTING_MASS:
        column = 3 + int(s[1])
        along = (body[column] * body[15] + body[column + 3] * body[16] + body[column + 6] * body[17]) / 9.80665
        moment = -A * sigmoid(along / s[0], s[3])
        u0, u1, u2 = body[column], body[column + 3], body[column + 6]
        out[16] += moment * (-u1 * body[17] + u2 * body[16])
        out[17] += moment * (-u2 * body[15] + u0 * body[17])
        out[18] += moment * (-u0 * body[16] + u1 * body[15])
    elif law == Law.FLOOR_VIBRATION:
        if dt > 0:
            a = A * np.sin(2 * np.pi * (s[0] + s[1] * t) * t + s[2]) * min(t / 2.0, 1.0)
            for k in range(3):
                out[19 + k] += a * s[3 + k]
    elif law == Law.FLOOR_TILT:
        a = 9.80665 * A * (1.0 - np.exp(-t / s[0]))
        out[19] += a * np.cos(s[1])
        out[20] += a * np.sin(s[1])
    elif law == Law.PLATE_STIFFENING:
        phi = motion[0, int(s[0])]
        out[int(s[0])] -= A * s[1] * (np.sinh(phi / s[1]) - phi / s[1])
    elif law == Law.PLATE_STOPS:
        out[int(s[0])] -= A * _stops(z, s[1], dt * motion[1, int(s[0])])
    elif law == Law.APPENDAGE:
        arm, n = np.zeros(3), np.zeros(3)
        _point(body, s[2], s[3], s[4], n)
        _point(body, s[5], s[6], s[7], arm)
        felt = n[0] * (body[15] + body[19] * arm[2] - body[20] * arm[1])
        felt += n[1] * (body[16] + body[20] * arm[0] - body[18] * arm[2])
        felt += n[2] * (body[17] + body[18] * arm[1] - body[19] * arm[0])
        omega = 2 * np.pi * s[0]
        if dt == 0.0:
            return
        if z[2] == 0.0:  # hangs at rest
            z[0], z[2] = -felt / omega**2, 1.0
        acceleration = -(omega**2) * z[0] - 2 * s[1] * omega * z[1] - felt
        z[1] += dt * acceleration
        z[0] += dt * z[1]
        for k in range(3):
            n[k] *= -A * acceleration
        _push(body, arm, n, out[13:19])


@njit(error_model="numpy", cache=True)
def act(t: float, dt: float, numbers: Any, memory: Any, motion: Any, bodies: Any, out: Any) -> None:
    """Let every row of `numbers` act once; see engine.ports."""
    for row in range(len(numbers)):
        p, z = numbers[row], memory[row]
        law, axis = int(p[0]), int(p[1])
        rotor = 3 + 2 * axis
        if law < 20:
            other = 5 - 2 * axis
            th, w = motion[0, rotor], motion[1, rotor]
            if law in (Law.STRIBECK, Law.WARM_UP, Law.RUB, Law.CROSS_AXIS):
                torque, loss = _sliding(p, t, th, w, motion[1, other])
                out[rotor] += torque
                out[22 + axis] += loss
            else:
                out[rotor] += _motor(p, z, dt, th, w, motion[2, axis])
                if law == Law.ODD_POWER:
                    u = min(abs(w) / p[SHAPES], 3.0)
                    out[22 + axis] += 3.0 * p[2] * u * u / p[SHAPES]
        elif law < 30:
            x = motion[0, rotor] / p[3] - motion[0, rotor + 1]
            v = motion[1, rotor] / p[3] - motion[1, rotor + 1]
            torque, slope = _transmission(p, z, dt, x, v, motion[0, rotor], motion[1, rotor])
            out[rotor + 1] += torque
            out[rotor] -= torque / p[3] + (p[4] * x + p[5] * v + torque) * slope
        elif law < 40:
            out[rotor + 1] += _joint(p, z, dt, motion[0, rotor + 1], motion[1, rotor + 1])
        elif law < 50:
            _ground(p, z, dt, motion, bodies, out)
        else:
            _structure(p, z, t, dt, motion, bodies, out)
