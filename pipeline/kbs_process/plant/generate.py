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
from kbs_process.plant.structure import (
    AXIS,
    DAMPING,
    DRIVE,
    GRAVITY,
    JOINTS,
    LINK,
    MICROSTEP,
    ORIGIN,
    PLATE,
    RATIO,
    ROTOR,
    STIFFNESS,
    TURN,
    Structure,
)

ROTOR_STEPS = 2


def module_text(structure: Structure) -> str:
    """Return the source of the plant's module."""
    return "\n".join(
        [
            *_head(structure),
            *_drive(structure),
            *_rotor(structure),
            *_forces(structure),
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


def _joint_offset(structure: Structure, joint: int) -> int:
    return JOINTS + joint * structure.stride


def _tuple(names: list[str]) -> str:
    return "(" + ", ".join(names) + ("," if len(names) == 1 else "") + ")"


def _head(structure: Structure) -> list[str]:
    shape = f"parents {structure.parents}, {'elastic' if structure.elastic else 'rigid'} base"
    lines = [
        f'"""Generated: plant with {shape}, effects {", ".join(e.name for e in structure.effects)}."""',
        "import math",
        "import numpy as np",
        "from numba import njit",
        "from kbs_process.plant.kernels import (",
        "    add3, add6, add_inertia, chain, cross3, cross_force, cross_motion, dot3, dot6, in_plate, inertia,",
        "    joint_rotation, mean_rounded, momentum, placed, plate_moment, plate_rates, relaxation, rotate, screw,",
        "    triple,",
        ")",
    ]
    for effect in structure.effects:
        function = effect.equation
        lines.append(f"from {function.__module__} import {function.__qualname__} as _{effect.name}")
    lines.append("")
    lines += [f'{e.name} = njit(error_model="numpy")(_{e.name})' for e in structure.effects]
    return [*lines, "", ""]


def _drive(structure: Structure) -> list[str]:
    """Emit the sum of all effects of a drive, port by port, in the catalogue's order."""
    totals = {
        Port.MOTOR_TORQUE: "motor",
        Port.MOTOR_FRICTION: "limit",
        Port.TRANSMISSION: "gear",
        Port.JOINT_TORQUE: "joint",
    }
    lines = [
        '@njit(error_model="numpy")',
        "def drive(field, rotor_angle, rotor_rate, joint_angle, joint_rate, ratio, time, z, p, k):",
        '    """Motor torque, Coulomb limit, gear torque, joint torque, then the rates of the effects\' states."""',
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
    here = _tuple([f"{n} + 0.5 * h * {d}" for n, d in zip(names, rates, strict=True)]) if z else "0.0"
    force = ", ".join(["motor", "limit", "gear", "joint", *rates])
    ahead = ", ".join(["motor_1", "_", "gear_1", "joint_1", *["_"] * z])
    return [
        '@njit(error_model="numpy")',
        "def turn_rotor(theta, spin, carrier, carrier_rate, q, qd, qdd, field_0, field_1, time, H, z, zd, p, k):",
        '    """Rotor angle, spin, mean torque on the output and the effects\' states at the end of a step.',
        "",
        "    `carrier` is the carrier's rate about the rotor's axis at the step's start, `q` the output's angle at",
        "    its middle, `qd` its rate at the start; `field_0` and `field_1` are in microsteps.",
        '    """',
        f"    h = H / {ROTOR_STEPS}",
        f"    ratio = p[k + {RATIO}]",
        f"    inertia_ = p[k + {ROTOR}]",
        f"    per_rad = p[k + {MICROSTEP}]",
        f"    slope = (field_1 - field_0) / {ROTOR_STEPS}",
        "    output = 0.0",
        *[f"    {n} = z[{i}]\n    {d} = zd[{i}]" for i, (n, d) in enumerate(zip(names, rates, strict=True))],
        f"    for i in range({ROTOR_STEPS}):",
        "        since = (i + 0.5) * h",
        "        angle = q + (since - 0.5 * H) * (qd + 0.5 * H * qdd)",
        "        rate = qd + since * qdd",
        "        w = spin - carrier - i * h * carrier_rate",
        "        mid = theta + 0.5 * h * w",
        "        field = mean_rounded(field_0 + i * slope, field_0 + (i + 1) * slope) / per_rad",
        f"        state = {here}",
        f"        {force} = drive(",
        f"            field, mid, w, angle, rate, ratio, time + since, state, p, k + {DRIVE}",
        "        )",
        # A difference: effects need not supply derivatives, and the compiler shares what does not depend on w.
        f"        {ahead} = drive(",
        f"            field, mid, w + 1e-6, angle, rate, ratio, time + since, state, p, k + {DRIVE}",
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
        "        spin = after + carrier + (i + 1) * h * carrier_rate",
        *[f"        {n} += h * {d}" for n, d in zip(names, rates, strict=True)],
        f"    return {', '.join(['theta', 'spin', f'output / {ROTOR_STEPS}', *names, *rates])}",
        "",
        "",
    ]


def _carrier(structure: Structure, joint: int) -> str:
    parent = structure.parents[joint]
    return "T" if parent < 0 else str(parent)


def _kinematics(structure: Structure) -> list[str]:
    """Emit orientation R, axis a, origin o, screw S and inertia I of every link, in the plate's axes."""
    lines = [f"    I_T = inertia(p, {PLATE})"]
    for j, parent in enumerate(structure.parents):
        k = _joint_offset(structure, j)
        axis, origin = f"triple(p, {k + AXIS})", f"triple(p, {k + ORIGIN})"
        rotation = f"joint_rotation(p, {k + TURN}, q_{j})"
        if parent >= 0:
            axis, rotation = f"rotate(R_{parent}, {axis})", f"chain(R_{parent}, {rotation})"
            origin = f"add3(o_{parent}, rotate(R_{parent}, {origin}))"
        lines += [
            f"    R_{j} = {rotation}",
            f"    a_{j} = {axis}",
            f"    o_{j} = {origin}",
            f"    S_{j} = screw(a_{j}, o_{j})",
            f"    I_{j} = placed(inertia(p, {k + LINK}), R_{j}, o_{j})",
        ]
    return lines


def _dynamics(structure: Structure) -> list[str]:
    """Emit accelerations (omegad_i, qdd_j) and the wrench, given rates, `moment` on the plate and torques.

    Recursive Newton-Euler for the terms without acceleration, composite bodies for the mass matrix.
    Gravity enters as an upward acceleration of everything.
    """
    n = structure.joints
    lines = [
        "    V_T = (omega[0], omega[1], omega[2], 0.0, 0.0, 0.0)",
        "    A_T = (0.0, 0.0, 0.0, -g[0], -g[1], -g[2])",
        "    F_T = add6(momentum(I_T, A_T), cross_force(V_T, momentum(I_T, V_T)), 1.0)",
    ]
    for j in range(n):
        c = _carrier(structure, j)
        lines += [
            f"    V_{j} = add6(V_{c}, S_{j}, qd_{j})",
            f"    A_{j} = add6(A_{c}, cross_motion(V_{c}, S_{j}), qd_{j})",
            f"    F_{j} = add6(momentum(I_{j}, A_{j}), cross_force(V_{j}, momentum(I_{j}, V_{j})), 1.0)",
        ]
    for j in range(n):
        c = _carrier(structure, j)
        lines += [  # the carrier turns and accelerates the rotor's angular momentum
            f"    y_{j} = cross3((V_{c}[0], V_{c}[1], V_{c}[2]), a_{j})",
            f"    F_{c} = add6(F_{c}, (a_{j}[0], a_{j}[1], a_{j}[2], 0.0, 0.0, 0.0), drag_{j})",
            f"    F_{c} = add6(F_{c}, (y_{j}[0], y_{j}[1], y_{j}[2], 0.0, 0.0, 0.0), momentum_{j})",
        ]
    for j in reversed(range(n)):
        c = _carrier(structure, j)
        lines += [
            f"    U_{j} = momentum(I_{j}, S_{j})",
            f"    b_{j} = out_{j} - dot6(S_{j}, F_{j})",
            f"    F_{c} = add6(F_{c}, F_{j}, 1.0)",
            f"    I_{c} = add_inertia(I_{c}, I_{j})",
        ]
    lines += _solve(structure)
    lines.append("    total = F_T")
    lines += [f"    total = add6(total, U_{j}, qdd_{j})" for j in range(n)]
    if structure.elastic:
        lines.append(
            "    total = add6(total, momentum(I_T, (omegad_0, omegad_1, omegad_2, 0.0, 0.0, 0.0)), 1.0)"
        )
    return lines


def _solve(structure: Structure) -> list[str]:
    """Emit M x = b by an unrolled L D L^T factorisation."""
    base = 3 if structure.elastic else 0
    size = structure.unknowns
    tensor = {(0, 0): 4, (1, 1): 5, (2, 2): 6, (1, 0): 7, (2, 0): 8, (2, 1): 9}

    def element(i: int, j: int) -> str:
        if i < base:
            return f"I_T[{tensor[i, j]}]"
        if j < base:
            return f"U_{i - base}[{j}]"
        row, column = i - base, j - base
        above = row
        while above > column:
            above = structure.parents[above]
        return f"dot6(S_{column}, U_{row})" if above == column else "0.0"

    lines = []
    for j in range(size):
        for i in range(j, size):
            terms = "".join(f" - l{i}{m} * l{j}{m} * d{m}" for m in range(j))
            name = f"d{j}" if i == j else f"l{i}{j}"
            value = f"{element(i, j)}{terms}"
            lines.append(f"    {name} = {value}" if i == j else f"    {name} = ({value}) / d{j}")
    for i in range(size):
        right = f"moment[{i}] - F_T[{i}]" if i < base else f"b_{i - base}"
        lines.append(f"    x{i} = {right}" + "".join(f" - l{i}{m} * x{m}" for m in range(i)))
    for i in reversed(range(size)):
        lines.append(f"    x{i} = x{i} / d{i}" + "".join(f" - l{m}{i} * x{m}" for m in range(i + 1, size)))
    names = [f"omegad_{i}" for i in range(base)] + [f"qdd_{j}" for j in range(structure.joints)]
    return lines + [f"    {name} = x{i}" for i, name in enumerate(names)]


def _forces(structure: Structure) -> list[str]:
    """Emit the moment of the elastic base and gravity in the plate's axes."""
    if not structure.elastic:
        return []
    springs = [f"-p[{STIFFNESS + i}] * alpha[{i}] - p[{DAMPING + i}] * rates[{i}]" for i in range(3)]
    return [
        '@njit(error_model="numpy")',
        "def base_moment(alpha, omega, p):",
        '    """Moment on the plate by the transducer\'s stiffness and damping, N m."""',
        "    rates = plate_rates(alpha, omega)",
        f"    return plate_moment(alpha, ({', '.join(springs)}))",
        "",
        "",
    ]


def _base(structure: Structure) -> list[str]:
    if not structure.elastic:
        return [f"    g = triple(p, {GRAVITY})", "    moment = (0.0, 0.0, 0.0)"]
    return [f"    g = in_plate(alpha, triple(p, {GRAVITY}))", "    moment = base_moment(alpha, omega, p)"]


def _step(structure: Structure) -> list[str]:
    layout = state_layout(structure)
    n, z = structure.joints, len(structure.states)

    def at(name: str, i: int = 0) -> str:
        return f"x[{layout[name].start + i}]"

    def vector(name: str) -> str:
        return f"triple(x, {layout[name].start})"

    lines = [
        '@njit(error_model="numpy")',
        "def step(x, field_0, field_1, time, H, p):",
        '    """Advance the state `x` by H; return the wrench (Fx, Fy, Fz, Tx, Ty, Tz) at the middle of the step."""',
        "    half = 0.5 * H",
    ]
    if structure.elastic:
        lines += [
            f"    rate_0 = {vector('omega')}",
            f"    rated_0 = {vector('omegad')}",
            f"    alpha_0 = {vector('alpha')}",
            "    rates = plate_rates(alpha_0, rate_0)",
            "    alpha = tuple_drift(alpha_0, rates, half)",
            "    omega = tuple_drift(rate_0, rated_0, half)",
        ]
    else:
        lines.append("    rate_0 = rated_0 = omega = (0.0, 0.0, 0.0)")
    for j in range(n):
        lines += [
            f"    start_{j} = {at('qd', j)}",
            f"    q_{j} = {at('q', j)} + half * start_{j}",
            f"    qd_{j} = start_{j} + half * {at('qdd', j)}",
        ]
    lines += _kinematics(structure)
    for j in range(n):
        terms, rates = [f"dot3(a_{j}, rate_0)"], [f"dot3(a_{j}, rated_0)"]
        above = structure.parents[j]
        while above >= 0:
            terms.append(f"dot3(a_{j}, a_{above}) * start_{above}")
            rates.append(f"dot3(a_{j}, a_{above}) * {at('qdd', above)}")
            above = structure.parents[above]
        states = _tuple([at("z", j * z + i) for i in range(z)]) if z else "0.0"
        state_rates = _tuple([at("zd", j * z + i) for i in range(z)]) if z else "0.0"
        ends = [at("z", j * z + i) for i in range(z)] + [at("zd", j * z + i) for i in range(z)]
        k = _joint_offset(structure, j)
        lines += [
            f"    spin_{j} = {at('spin', j)}",
            f"    {', '.join([at('theta', j), at('spin', j), f'out_{j}', *ends])} = turn_rotor(",
            f"        {at('theta', j)}, spin_{j}, {' + '.join(terms)}, {' + '.join(rates)},",
            f"        q_{j}, start_{j}, {at('qdd', j)}, field_0[{j}], field_1[{j}], time, H,",
            f"        {states}, {state_rates}, p, {k},",
            "    )",
            f"    drag_{j} = p[{k + ROTOR}] * ({at('spin', j)} - spin_{j}) / H",
            f"    momentum_{j} = p[{k + ROTOR}] * 0.5 * ({at('spin', j)} + spin_{j})",
        ]
    lines += _base(structure)
    lines += _dynamics(structure)
    if structure.elastic:
        for i in range(3):
            lines.append(f"    {at('omegad', i)} = omegad_{i}")
            lines.append(f"    {at('omega', i)} += H * omegad_{i}")
        lines.append(f"    rates = plate_rates(alpha, {vector('omega')})")
        lines += [f"    {at('alpha', i)} = alpha[{i}] + half * rates[{i}]" for i in range(3)]
    for j in range(n):
        lines += [
            f"    {at('qdd', j)} = qdd_{j}",
            f"    {at('qd', j)} += H * qdd_{j}",
            f"    {at('q', j)} = q_{j} + half * {at('qd', j)}",
        ]
    lines.append("    return (-total[3], -total[4], -total[5], -total[0], -total[1], -total[2])")
    return [
        '@njit(error_model="numpy")',
        "def tuple_drift(a, b, h):",
        '    """a + h b"""',
        "    return (a[0] + h * b[0], a[1] + h * b[1], a[2] + h * b[2])",
        "",
        "",
        *lines,
        "",
        "",
    ]


def _balance(structure: Structure) -> list[str]:
    """Emit the accelerations at rest, which vanish in static equilibrium."""
    layout = state_layout(structure)
    n, z = structure.joints, len(structure.states)
    lines = [
        '@njit(cache=True, error_model="numpy")',
        "def balance(x, field, p, acceleration):",
        '    """Accelerations of base, outputs and rotors at rest without Coulomb friction; return the wrench."""',
    ]
    if structure.elastic:
        lines.append(f"    alpha = triple(x, {layout['alpha'].start})")
    lines.append("    omega = (0.0, 0.0, 0.0)")
    lines += [f"    q_{j} = x[{layout['q'].start + j}]\n    qd_{j} = 0.0" for j in range(n)]
    lines += _kinematics(structure)
    for j in range(n):
        k = _joint_offset(structure, j)
        first = layout["z"].start + j * z
        states = _tuple([f"x[{first + i}]" for i in range(z)]) if z else "0.0"
        lines += [
            f"    {', '.join([f'motor_{j}', '_', f'gear_{j}', f'joint_{j}', *['_'] * z])} = drive(",
            f"        math.floor(field[{j}] + 0.5) / p[{k + MICROSTEP}], x[{layout['theta'].start + j}], 0.0,",
            f"        q_{j}, 0.0, p[{k + RATIO}], 0.0, {states}, p, {k + DRIVE},",
            "    )",
            f"    out_{j} = gear_{j} + joint_{j}",
            f"    drag_{j} = motor_{j} - gear_{j} / p[{k + RATIO}]",
            f"    momentum_{j} = 0.0",
        ]
    lines += _base(structure)
    lines += _dynamics(structure)
    names = [f"omegad_{i}" if structure.elastic else "0.0" for i in range(3)]
    names += [f"qdd_{j}" for j in range(n)]
    names += [f"drag_{j} / p[{_joint_offset(structure, j) + ROTOR}]" for j in range(n)]
    lines += [f"    acceleration[{i}] = {name}" for i, name in enumerate(names)]
    return [*lines, "    return (-total[3], -total[4], -total[5], -total[0], -total[1], -total[2])", "", ""]
