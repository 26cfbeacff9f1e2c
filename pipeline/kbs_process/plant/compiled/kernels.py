"""Spatial algebra on tuples of floats, which the compiler unrolls and keeps in registers.

Every spatial vector refers to one point, T's origin, and one set of axes, the top plate's at that instant:
motion vectors are (angular, linear velocity of the body's point at the origin), force vectors (moment about
the origin, force), and the inertia of a body is (m, h, I): mass, first moment m r and the tensor
(xx, yy, zz, xy, xz, yz) about the origin. One point for all makes sums out of transformations
(R. Featherstone, Rigid Body Dynamics Algorithms, 2008, chapter 2).
"""

from __future__ import annotations

from typing import Any

from numba import types
from numba.extending import intrinsic

from kbs_process.plant.compiled import elementary
from kbs_process.plant.compiled.elementary import F, compiled, cos, floor, linked, sin
from kbs_process.signals.records import Array

Vector = tuple[float, float, float]
Matrix = tuple[float, float, float, float, float, float, float, float, float]  # row by row
Spatial = tuple[float, float, float, float, float, float]
Inertia = tuple[float, float, float, float, float, float, float, float, float, float]


def compiled_effect(equation: F) -> F:
    """Compile an effect's equation, a plain function of floats, with the inlined sine and cosine."""
    return linked(equation, compiled, math=elementary)


@compiled
def dot3(a: Vector, b: Vector) -> float:
    """a . b"""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled
def cross3(a: Vector, b: Vector) -> Vector:
    """a x b"""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@compiled
def add3(a: Vector, b: Vector) -> Vector:
    """a + b"""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@compiled
def drift(a: Vector, rate: Vector, h: float) -> Vector:
    """a + h rate"""
    return (a[0] + h * rate[0], a[1] + h * rate[1], a[2] + h * rate[2])


@compiled
def rotate(R: Matrix, v: Vector) -> Vector:
    """R v"""
    return (
        R[0] * v[0] + R[1] * v[1] + R[2] * v[2],
        R[3] * v[0] + R[4] * v[1] + R[5] * v[2],
        R[6] * v[0] + R[7] * v[1] + R[8] * v[2],
    )


@compiled
def chain(A: Matrix, B: Matrix) -> Matrix:
    """A B"""
    return (
        A[0] * B[0] + A[1] * B[3] + A[2] * B[6],
        A[0] * B[1] + A[1] * B[4] + A[2] * B[7],
        A[0] * B[2] + A[1] * B[5] + A[2] * B[8],
        A[3] * B[0] + A[4] * B[3] + A[5] * B[6],
        A[3] * B[1] + A[4] * B[4] + A[5] * B[7],
        A[3] * B[2] + A[4] * B[5] + A[5] * B[8],
        A[6] * B[0] + A[7] * B[3] + A[8] * B[6],
        A[6] * B[1] + A[7] * B[4] + A[8] * B[7],
        A[6] * B[2] + A[7] * B[5] + A[8] * B[8],
    )


@compiled
def triple(p: Array, k: int) -> Vector:
    """Three numbers of the parameter vector, from `k` on."""
    return (p[k], p[k + 1], p[k + 2])


@compiled
def joint_rotation(p: Array, k: int, angle: float) -> Matrix:
    """Orientation of a joint's link in its parent: P0 + P1 cos(angle) + P2 sin(angle)."""
    c = cos(angle)
    s = sin(angle)
    return (
        p[k] + c * p[k + 9] + s * p[k + 18],
        p[k + 1] + c * p[k + 10] + s * p[k + 19],
        p[k + 2] + c * p[k + 11] + s * p[k + 20],
        p[k + 3] + c * p[k + 12] + s * p[k + 21],
        p[k + 4] + c * p[k + 13] + s * p[k + 22],
        p[k + 5] + c * p[k + 14] + s * p[k + 23],
        p[k + 6] + c * p[k + 15] + s * p[k + 24],
        p[k + 7] + c * p[k + 16] + s * p[k + 25],
        p[k + 8] + c * p[k + 17] + s * p[k + 26],
    )


@compiled
def inertia(p: Array, k: int) -> Inertia:
    """Inertia of a link about its own origin, in its own axes."""
    return (p[k], p[k + 1], p[k + 2], p[k + 3], p[k + 4], p[k + 5], p[k + 6], p[k + 7], p[k + 8], p[k + 9])


@compiled
def placed(b: Inertia, R: Matrix, o: Vector) -> Inertia:
    """Inertia `b` of a link of orientation `R` with its origin at `o`, referred to T's origin."""
    m, hx, hy, hz, xx, yy, zz, xy, xz, yz = b
    gx = R[0] * hx + R[1] * hy + R[2] * hz
    gy = R[3] * hx + R[4] * hy + R[5] * hz
    gz = R[6] * hx + R[7] * hy + R[8] * hz
    # Rows of R I.
    a0 = R[0] * xx + R[1] * xy + R[2] * xz
    a1 = R[0] * xy + R[1] * yy + R[2] * yz
    a2 = R[0] * xz + R[1] * yz + R[2] * zz
    b0 = R[3] * xx + R[4] * xy + R[5] * xz
    b1 = R[3] * xy + R[4] * yy + R[5] * yz
    b2 = R[3] * xz + R[4] * yz + R[5] * zz
    c0 = R[6] * xx + R[7] * xy + R[8] * xz
    c1 = R[6] * xy + R[7] * yy + R[8] * yz
    c2 = R[6] * xz + R[7] * yz + R[8] * zz
    # Steiner: I_O = R I R^T + 2 (o . g) - o g^T - g o^T + m (o . o - o o^T), with g = R h.
    ux = m * o[0] + 2.0 * gx
    uy = m * o[1] + 2.0 * gy
    uz = m * o[2] + 2.0 * gz
    return (
        m,
        gx + m * o[0],
        gy + m * o[1],
        gz + m * o[2],
        a0 * R[0] + a1 * R[1] + a2 * R[2] + o[1] * uy + o[2] * uz,
        b0 * R[3] + b1 * R[4] + b2 * R[5] + o[0] * ux + o[2] * uz,
        c0 * R[6] + c1 * R[7] + c2 * R[8] + o[0] * ux + o[1] * uy,
        a0 * R[3] + a1 * R[4] + a2 * R[5] - m * o[0] * o[1] - o[0] * gy - o[1] * gx,
        a0 * R[6] + a1 * R[7] + a2 * R[8] - m * o[0] * o[2] - o[0] * gz - o[2] * gx,
        b0 * R[6] + b1 * R[7] + b2 * R[8] - m * o[1] * o[2] - o[1] * gz - o[2] * gy,
    )


@compiled
def add_inertia(a: Inertia, b: Inertia) -> Inertia:
    """Inertia of two bodies together."""
    return (
        a[0] + b[0],
        a[1] + b[1],
        a[2] + b[2],
        a[3] + b[3],
        a[4] + b[4],
        a[5] + b[5],
        a[6] + b[6],
        a[7] + b[7],
        a[8] + b[8],
        a[9] + b[9],
    )


@compiled
def screw(a: Vector, o: Vector) -> Spatial:
    """Motion of unit rate about the axis `a` through `o`."""
    return (a[0], a[1], a[2], o[1] * a[2] - o[2] * a[1], o[2] * a[0] - o[0] * a[2], o[0] * a[1] - o[1] * a[0])


@compiled
def add6(a: Spatial, b: Spatial, x: float) -> Spatial:
    """a + x b"""
    return (a[0] + x * b[0], a[1] + x * b[1], a[2] + x * b[2], a[3] + x * b[3], a[4] + x * b[4], a[5] + x * b[5])


@compiled
def dot6(motion: Spatial, force: Spatial) -> float:
    """Power of a force in a motion."""
    return (
        motion[0] * force[0]
        + motion[1] * force[1]
        + motion[2] * force[2]
        + motion[3] * force[3]
        + motion[4] * force[4]
        + motion[5] * force[5]
    )


@compiled
def momentum(b: Inertia, v: Spatial) -> Spatial:
    """Inertia times motion: (I w + h x v, m v - h x w)."""
    m, hx, hy, hz, xx, yy, zz, xy, xz, yz = b
    return (
        xx * v[0] + xy * v[1] + xz * v[2] + hy * v[5] - hz * v[4],
        xy * v[0] + yy * v[1] + yz * v[2] + hz * v[3] - hx * v[5],
        xz * v[0] + yz * v[1] + zz * v[2] + hx * v[4] - hy * v[3],
        m * v[3] + v[1] * hz - v[2] * hy,
        m * v[4] + v[2] * hx - v[0] * hz,
        m * v[5] + v[0] * hy - v[1] * hx,
    )


@compiled
def cross_motion(v: Spatial, s: Spatial) -> Spatial:
    """Rate of the motion vector `s` carried along by `v`: (w x s_w, w x s_v + v x s_w)."""
    return (
        v[1] * s[2] - v[2] * s[1],
        v[2] * s[0] - v[0] * s[2],
        v[0] * s[1] - v[1] * s[0],
        v[1] * s[5] - v[2] * s[4] + v[4] * s[2] - v[5] * s[1],
        v[2] * s[3] - v[0] * s[5] + v[5] * s[0] - v[3] * s[2],
        v[0] * s[4] - v[1] * s[3] + v[3] * s[1] - v[4] * s[0],
    )


@compiled
def cross_force(v: Spatial, f: Spatial) -> Spatial:
    """Rate of the force vector `f` carried along by `v`: (w x n + v x f, w x f)."""
    return (
        v[1] * f[2] - v[2] * f[1] + v[4] * f[5] - v[5] * f[4],
        v[2] * f[0] - v[0] * f[2] + v[5] * f[3] - v[3] * f[5],
        v[0] * f[1] - v[1] * f[0] + v[3] * f[4] - v[4] * f[3],
        v[1] * f[5] - v[2] * f[4],
        v[2] * f[3] - v[0] * f[5],
        v[0] * f[4] - v[1] * f[3],
    )


@compiled
def rotor_moment(v: Spatial, a: Vector, drag: float, h: float) -> Spatial:
    """Force that changes a rotor's angular momentum h a by drag a + h w x a, its carrier moving with `v`."""
    return (
        drag * a[0] + h * (v[1] * a[2] - v[2] * a[1]),
        drag * a[1] + h * (v[2] * a[0] - v[0] * a[2]),
        drag * a[2] + h * (v[0] * a[1] - v[1] * a[0]),
        0.0,
        0.0,
        0.0,
    )


@compiled
def plate_rates(alpha: Vector, w: Vector) -> Vector:
    """Rates of the base's angles, turned about x, then y, then z, from the plate's rate in its own axes."""
    c2, s2 = cos(alpha[1]), sin(alpha[1])
    c3, s3 = cos(alpha[2]), sin(alpha[2])
    x = (c3 * w[0] - s3 * w[1]) / c2
    return (x, s3 * w[0] + c3 * w[1], w[2] - s2 * x)


@compiled
def plate_moment(alpha: Vector, Q: Vector) -> Vector:
    """Moment on the plate, in its axes, of torques `Q` about the axes that the base's angles turn about."""
    c2, s2 = cos(alpha[1]), sin(alpha[1])
    c3, s3 = cos(alpha[2]), sin(alpha[2])
    x = (Q[0] - s2 * Q[2]) / c2
    return (c3 * x + s3 * Q[1], c3 * Q[1] - s3 * x, Q[2])


@compiled
def in_plate(alpha: Vector, v: Vector) -> Vector:
    """Components in the plate's axes, deflected by `alpha`, of a vector given in the undeflected T."""
    c1, s1 = cos(alpha[0]), sin(alpha[0])
    c2, s2 = cos(alpha[1]), sin(alpha[1])
    c3, s3 = cos(alpha[2]), sin(alpha[2])
    y = c1 * v[1] + s1 * v[2]
    z = c1 * v[2] - s1 * v[1]
    x = c2 * v[0] - s2 * z
    return (c3 * x + s3 * y, c3 * y - s3 * x, s2 * v[0] + c2 * z)


@compiled
def from_plate(alpha: Vector, v: Vector) -> Vector:
    """Components in the undeflected T of a vector given in the plate's axes, deflected by `alpha`."""
    c1, s1 = cos(alpha[0]), sin(alpha[0])
    c2, s2 = cos(alpha[1]), sin(alpha[1])
    c3, s3 = cos(alpha[2]), sin(alpha[2])
    x = c3 * v[0] - s3 * v[1]
    y = s3 * v[0] + c3 * v[1]
    z = c2 * v[2] - s2 * x
    return (c2 * x + s2 * v[2], c1 * y - s1 * z, s1 * y + c1 * z)


@compiled
def velocity_at(v: Spatial, r: Vector) -> Vector:
    """Velocity of the point at `r` of a body that moves with `v`."""
    return (v[3] + v[1] * r[2] - v[2] * r[1], v[4] + v[2] * r[0] - v[0] * r[2], v[5] + v[0] * r[1] - v[1] * r[0])


@compiled
def force_at(r: Vector, f: Vector) -> Spatial:
    """The force `f` at `r`, referred to T's origin."""
    return (r[1] * f[2] - r[2] * f[1], r[2] * f[0] - r[0] * f[2], r[0] * f[1] - r[1] * f[0], f[0], f[1], f[2])


@compiled
def yielding(change: float, drop: float) -> float:
    """Share of a step's impulse left by a damping that takes `drop` (of rate) when the rate grows by `change`.

    (exp(x) - 1) / x with x = drop / change, from x / (exp(x) - 1) = 1 - x/2 + x^2/12 - ..., whose inverse is right
    to x^4 / 720, positive for all x, and tends to zero with a strong damping. Without a change: 1.
    """
    square = change * change + 1e-60
    return square / (square - 0.5 * change * drop + drop * drop / 12.0)


@compiled
def mean_rounded(a: float, b: float, inverse: float) -> float:
    """Mean of the nearest whole number over [a, b], `inverse` = 1 / (b - a); 0.5 rounds up.

    The integral of x - round(x) is half its square, which repeats every unit: no step of the staircase is
    lost between two time steps, whatever their ratio.
    """
    if abs(b - a) < 1e-6:
        return floor(0.5 * (a + b) + 0.5)
    ra = a - floor(a + 0.5)
    rb = b - floor(b + 0.5)
    return 0.5 * (a + b) - 0.5 * (rb * rb - ra * ra) * inverse


@intrinsic
def address(typing: Any, array: Any) -> Any:
    """Pointer to the first number of an array."""

    def code(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        return context.make_array(signature.args[0])(context, builder, given[0]).data

    signature: Any = types.CPointer(array.dtype)(array)  # type: ignore[no-untyped-call]
    return signature, code
