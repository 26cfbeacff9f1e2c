"""Write the plant of one structure as a module: its joints unrolled, its effects called one by one.

Scheme, of second order in the step H (position Verlet with the rotors sub-cycled):
positions drift half a step; there the multibody equations are set up once; each rotor turns through the step
in `ROTOR_STEPS` of its own against the smoothly moving rest; the momenta that the rotors gained and the mean
gear torques drive the multibody step; positions drift the other half. A rotor's velocity-dependent torque is
integrated exponentially (its slope reaches 2e4 1/s at standstill), its Coulomb friction exactly: the rotor
stands where the friction can hold it.
"""

from __future__ import annotations

from kbs_process.plant.effect import Port
from kbs_process.plant.loop import LOOP
from kbs_process.plant.multibody import carrier, joint_offset, multibody_text, unrolled
from kbs_process.plant.structure import DRIVE, MICROSTEP, RATIO, ROTOR, Structure

ROTOR_STEPS = 2


def module_text(structure: Structure) -> str:
    """Return the source of the plant's module."""
    return "\n".join(
        [
            *_head(structure),
            *_drive(structure),
            *_rotor(structure),
            *multibody_text(structure),
            *_step(structure),
            *_balance(structure),
            LOOP,
        ]
    )


def state_layout(structure: Structure) -> dict[str, slice]:
    """Return where each part of the state vector is."""
    n, z = structure.joints, len(structure.states)
    sizes = {
        "alpha": 3,  # base angles, rad
        "omega": 3,  # rate of the plate in its own axes, rad/s
        "q": n,  # joint angles, rad
        "qd": n,
        "theta": n,  # rotor angles with respect to their carriers, rad
        "spin": n,  # absolute rates of the rotors about their axes, rad/s
        "omegad": 3,  # accelerations of the step before, which predict those at mid-step
        "qdd": n,
        "z": n * z,  # the effects' own states, drive by drive
        "zd": n * z,
    }
    layout, start = {}, 0
    for name, size in sizes.items():
        layout[name] = slice(start, start + size)
        start += size
    return layout


def _tuple(names: list[str]) -> str:
    """Return a tuple of some expressions; the compiler wants one that is not empty."""
    return "(" + ", ".join(names or ["0.0"]) + ",)"


def _head(structure: Structure) -> list[str]:
    shape = f"parents {structure.parents}, {'elastic' if structure.elastic else 'rigid'} base"
    return [
        f'"""Generated: plant with {shape}, effects {", ".join(e.name for e in structure.effects)}."""',
        "import math",
        "import numpy as np",
        "from numba import njit",
        "from kbs_process.plant.kernels import (",
        "    add3, add6, add_inertia, chain, compiled, cross3, cross_force, cross_motion, dot3, dot6,",
        "    drift, in_plate, inertia, joint_rotation, mean_rounded, momentum, placed, plate_moment, plate_rates,",
        "    relaxation, rotate, rotor_moment, screw, triple,",
        ")",
        *[
            f"from {e.equation.__module__} import {e.equation.__qualname__} as _{e.name}"
            for e in structure.effects
        ],
        "",
        *[f"{e.name} = compiled(_{e.name})" for e in structure.effects],
        "",
        "",
    ]


def _drive(structure: Structure) -> list[str]:
    """Emit the sum of all effects of a drive, port by port, in the catalogue's order."""
    totals = {
        Port.MOTOR_TORQUE: "motor",
        Port.MOTOR_FRICTION: "limit",
        Port.TRANSMISSION: "gear",
        Port.JOINT_TORQUE: "joint",
    }
    lines = [
        "@compiled",
        "def drive(field, rotor_angle, rotor_rate, joint_angle, joint_rate, ratio, time, z, p, k):",
        '    """Motor torque, Coulomb limit, gear torque, joint torque, then the rates of the states."""',
        *[f"    {total} = 0.0" for total in totals.values()],
    ]
    rates: list[str] = []
    parameter = 0
    for effect in structure.effects:
        wires = {}
        for entry in effect.parameters:
            wires[entry.name] = f"p[k + {parameter}]"
            parameter += 1
        results = []
        for state in effect.states:
            wires[state.name] = f"z[{len(rates)}]"
            rates.append(f"{effect.name}_{state.name}")
            results.append(rates[-1])
        call = f"{effect.name}({', '.join(wires.get(name, name) for name in effect.arguments)})"
        lines.append(f"    {', '.join(['value', *results])} = {call}")
        lines.append(f"    {totals[effect.port]} += value")
    return [*lines, f"    return {', '.join([*totals.values(), *rates])}", "", ""]


def _rotor(structure: Structure) -> list[str]:
    """Emit the motion of a rotor through one step."""
    z = len(structure.states)
    names = [f"z{i}" for i in range(z)]
    rates = [f"d{i}" for i in range(z)]
    here = _tuple([f"{n} + 0.5 * h * {d}" for n, d in zip(names, rates, strict=True)])
    force = ", ".join(["motor", "limit", "gear", "joint", *rates])
    ahead = ", ".join(["motor_1", "_", "gear_1", "joint_1", *["_"] * z])
    return [
        "@compiled",
        "def turn_rotor(",
        "    theta, spin, carrier, carrier_rate, q, qd, qdd, field_0, field_1, time, H, z, zd, p, k",
        "):",
        '    """Rotor angle, spin, mean torque on the output and the effects\' states at the end of a step.',
        "",
        "    `carrier` is the carrier's rate about the rotor's axis, `q` and `qd` the output's angle and rate,",
        "    all in the middle of the step; `field_0` and `field_1` are in microsteps.",
        '    """',
        f"    h = H / {ROTOR_STEPS}",
        f"    ratio = p[k + {RATIO}]",
        f"    inertia_ = p[k + {ROTOR}]",
        f"    per_rad = p[k + {MICROSTEP}]",
        f"    slope = (field_1 - field_0) / {ROTOR_STEPS}",
        "    output = 0.0",
        *[f"    {n} = z[{i}]\n    {d} = zd[{i}]" for i, (n, d) in enumerate(zip(names, rates, strict=True))],
        f"    for i in range({ROTOR_STEPS}):",
        "        off = (i + 0.5) * h - 0.5 * H",
        "        angle = q + off * qd",
        "        rate = qd + off * qdd",
        "        w = spin - carrier - (off - 0.5 * h) * carrier_rate",
        "        mid = theta + 0.5 * h * w",
        "        field = mean_rounded(field_0 + i * slope, field_0 + (i + 1) * slope) / per_rad",
        f"        state = {here}",
        f"        {force} = drive(",
        f"            field, mid, w, angle, rate, ratio, time + off, state, p, k + {DRIVE}",
        "        )",
        # A difference: effects need no derivatives, and the compiler shares what does not depend on w.
        f"        {ahead} = drive(",
        f"            field, mid, w + 1e-6, angle, rate, ratio, time + off, state, p, k + {DRIVE}",
        "        )",
        "        torque = motor - gear / ratio",
        "        damping = (motor_1 - gear_1 / ratio - torque) / 1e-6",
        "        mobility = h / inertia_ * relaxation(min(0.0, damping) * h / inertia_)",
        "        free = w + mobility * torque - h * carrier_rate",
        "        held = mobility * limit",
        "        after = free - held if free > held else free + held if free < -held else 0.0",
        # The output feels the gear at the mean rate of the sub-step.
        "        output += gear + joint + (gear_1 + joint_1 - gear - joint) / 1e-6 * 0.5 * (after - w)",
        "        theta = mid + 0.5 * h * after",
        "        spin = after + carrier + (off + 0.5 * h) * carrier_rate",
        *[f"        {n} += h * {d}" for n, d in zip(names, rates, strict=True)],
        f"    return {', '.join(['theta', 'spin', f'output / {ROTOR_STEPS}', *names, *rates])}",
        "",
        "",
    ]


def _step(structure: Structure) -> list[str]:
    layout = state_layout(structure)
    n, z = structure.joints, len(structure.states)

    def at(name: str, i: int = 0) -> str:
        return f"x[{layout[name].start + i}]"

    def vector(name: str) -> str:
        return f"triple(x, {layout[name].start})"

    lines = [
        "@compiled",
        "def step(x, field_0, field_1, time, H, p):",
        '    """Advance the state `x` by H; return the wrench in the middle of the step, force first."""',
        "    half = 0.5 * H",
        f"    rate_0 = {vector('omega')}",
        f"    omegad_T = {vector('omegad')}",
        f"    alpha_0 = {vector('alpha')}",
        "    alpha = drift(alpha_0, plate_rates(alpha_0, rate_0), half)",
        "    omega = omega_T = drift(rate_0, omegad_T, half)",
    ]
    for j in range(n):
        lines += [
            f"    q_{j} = {at('q', j)} + half * {at('qd', j)}",
            f"    qd_{j} = {at('qd', j)} + half * {at('qdd', j)}",
        ]
    lines.append(f"    {unrolled('a_#, S_#, I_#', n)} = place({unrolled('q_#', n)}, p)")
    for j in range(n):
        c = carrier(structure, j)
        if j in structure.parents:
            lines += [
                f"    omega_{j} = drift(omega_{c}, a_{j}, qd_{j})",
                f"    turning = drift(omegad_{c}, a_{j}, {at('qdd', j)})",
                f"    omegad_{j} = drift(turning, cross3(omega_{c}, a_{j}), qd_{j})",
            ]
        own = range(j * z, (j + 1) * z)
        results = [
            at("theta", j),
            at("spin", j),
            f"out_{j}",
            *[at("z", i) for i in own],
            *[at("zd", i) for i in own],
        ]
        k = joint_offset(structure, j)
        lines += [
            f"    spin_{j} = {at('spin', j)}",
            f"    {', '.join(results)} = turn_rotor(",
            f"        {at('theta', j)}, spin_{j}, dot3(a_{j}, omega_{c}), dot3(a_{j}, omegad_{c}),",
            f"        q_{j}, qd_{j}, {at('qdd', j)}, field_0[{j}], field_1[{j}], time + half, H,",
            f"        {_tuple([at('z', i) for i in own])}, {_tuple([at('zd', i) for i in own])}, p, {k},",
            "    )",
            f"    drag_{j} = p[{k + ROTOR}] * ({at('spin', j)} - spin_{j}) / H",
            f"    momentum_{j} = p[{k + ROTOR}] * 0.5 * ({at('spin', j)} + spin_{j})",
        ]
    lines += _accelerated(structure)
    if structure.elastic:
        for i in range(3):
            lines += [
                f"    {at('omegad', i)} = omegad[{i}]",
                f"    {at('omega', i)} += H * omegad[{i}]",
            ]
        lines.append(f"    alpha = drift(alpha, plate_rates(alpha, {vector('omega')}), half)")
        lines += [f"    {at('alpha', i)} = alpha[{i}]" for i in range(3)]
    for j in range(n):
        lines += [
            f"    {at('qdd', j)} = qdd_{j}",
            f"    {at('qd', j)} += H * qdd_{j}",
            f"    {at('q', j)} = q_{j} + half * {at('qd', j)}",
        ]
    return [*lines, "    return wrench", "", ""]


def _accelerated(structure: Structure) -> list[str]:
    n = structure.joints
    given = ("a_#, S_#, I_#", "qd_#", "out_#", "drag_#", "momentum_#")
    return [
        f"    omegad, {unrolled('qdd_#', n)}, wrench = accelerate(",
        "        alpha, omega,",
        *[f"        {unrolled(pattern, n)}," for pattern in given],
        "        p,",
        "    )",
    ]


def _balance(structure: Structure) -> list[str]:
    """Emit the accelerations at rest, which vanish in static equilibrium."""
    layout = state_layout(structure)
    n, z = structure.joints, len(structure.states)
    lines = [
        '@njit(cache=True, error_model="numpy")',
        "def balance(x, field, p, acceleration):",
        '    """Accelerations at rest of base, outputs and rotors, less Coulomb friction; return the wrench."""',
        f"    alpha = triple(x, {layout['alpha'].start})",
        "    omega = (0.0, 0.0, 0.0)",
        *[f"    q_{j} = x[{layout['q'].start + j}]\n    qd_{j} = 0.0" for j in range(n)],
        f"    {unrolled('a_#, S_#, I_#', n)} = place({unrolled('q_#', n)}, p)",
    ]
    for j in range(n):
        k = joint_offset(structure, j)
        states = _tuple([f"x[{layout['z'].start + i}]" for i in range(j * z, (j + 1) * z)])
        rotor = f"x[{layout['theta'].start + j}]"
        lines += [
            f"    field_{j} = math.floor(field[{j}] + 0.5) / p[{k + MICROSTEP}]",
            f"    {', '.join(['motor', '_', 'gear', 'joint', *['_'] * z])} = drive(",
            f"        field_{j}, {rotor}, 0.0, q_{j}, 0.0, p[{k + RATIO}], 0.0, {states}, p, {k + DRIVE}",
            "    )",
            f"    out_{j} = gear + joint",
            f"    drag_{j} = motor - gear / p[{k + RATIO}]",
            f"    momentum_{j} = 0.0",
        ]
    lines += _accelerated(structure)
    names = [f"omegad[{i}]" for i in range(3)] + [f"qdd_{j}" for j in range(n)]
    names += [f"drag_{j} / p[{joint_offset(structure, j) + ROTOR}]" for j in range(n)]
    lines += [f"    acceleration[{i}] = {name}" for i, name in enumerate(names)]
    return [*lines, "    return wrench", "", ""]
