"""Write the multibody equations of a tree of links on the transducer's plate, unrolled link by link.

Everything is in the plate's axes about T's origin (see `kernels`). Recursive Newton-Euler gives what acts
without acceleration, composite bodies give the mass matrix, an unrolled L D L^T factorisation the
accelerations; gravity enters as an upward acceleration of everything. Rotors are not in the mass matrix: a
rotor's spin follows from its own torque, and its carrier feels the change of its angular momentum.
(R. Featherstone, Rigid Body Dynamics Algorithms, 2008, chapters 5 and 6.)
"""

from __future__ import annotations

from kbs_process.plant.structure import (
    AXIS,
    DAMPING,
    GRAVITY,
    JOINTS,
    LINK,
    ORIGIN,
    PLATE,
    STIFFNESS,
    TURN,
    Structure,
)


def joint_offset(structure: Structure, joint: int) -> int:
    """Return where the numbers of a joint begin in the parameter vector."""
    return JOINTS + joint * structure.stride


def unrolled(pattern: str, count: int) -> str:
    """Return `pattern`, such as "q_#", once for each joint, separated by commas."""
    return ", ".join(pattern.replace("#", str(j)) for j in range(count))


def multibody_text(structure: Structure) -> list[str]:
    """Return `place` (where the links are) and `accelerate` (what they do)."""
    return [*_place(structure), "", "", *_base(structure), "", "", *_accelerate(structure), "", ""]


def carrier(structure: Structure, joint: int) -> str:
    """Return the suffix of the link that carries a joint's motor."""
    parent = structure.parents[joint]
    return "T" if parent < 0 else str(parent)


def _place(structure: Structure) -> list[str]:
    """Emit axis a, screw S and inertia I of every link; R is its orientation, o its origin."""
    n = structure.joints
    lines = [
        "@compiled",
        f"def place({unrolled('q_#', n)}, p):",
        '    """Axes, screws and inertias of the links, in the plate\'s axes about T\'s origin."""',
    ]
    for j, parent in enumerate(structure.parents):
        k = joint_offset(structure, j)
        axis, origin = f"triple(p, int({k + AXIS}))", f"triple(p, int({k + ORIGIN}))"
        rotation = f"joint_rotation(p, int({k + TURN}), q_{j})"
        if parent >= 0:
            axis, rotation = f"rotate(R_{parent}, {axis})", f"chain(R_{parent}, {rotation})"
            origin = f"add3(o_{parent}, rotate(R_{parent}, {origin}))"
        lines += [
            f"    R_{j} = {rotation}",
            f"    a_{j} = {axis}",
            f"    o_{j} = {origin}",
            f"    S_{j} = screw(a_{j}, o_{j})",
            f"    I_{j} = placed(inertia(p, int({k + LINK})), R_{j}, o_{j})",
        ]
    return [*lines, f"    return {unrolled('a_#, S_#, I_#', n)}"]


def _base(structure: Structure) -> list[str]:
    """Emit gravity in the plate's axes and the moment of the transducer's elasticity on the plate."""
    springs = [f"-p[{STIFFNESS + i}] * alpha[{i}] - p[{DAMPING + i}] * rates[{i}]" for i in range(3)]
    return [
        "@compiled",
        "def base(alpha, omega, p):",
        '    """Gravity (m/s^2) and the moment of stiffness and damping on the plate (N m), in its axes."""',
        "    rates = plate_rates(alpha, omega)",
        f"    moment = plate_moment(alpha, ({', '.join(springs)}))",
        f"    return in_plate(alpha, triple(p, int({GRAVITY}))), moment",
    ]


def _accelerate(structure: Structure) -> list[str]:
    n = structure.joints
    given = ("a_#, S_#, I_#", "qd_#", "out_#", "drag_#", "momentum_#")
    lines = [
        "@compiled",
        "def accelerate(",
        "    alpha, omega,",
        *[f"    {unrolled(pattern, n)}," for pattern in given],
        "    guess, yields, p,",
        "):",
        '    """Accelerations of plate and joints, and the wrench on the transducer, force first.',
        "",
        "    `out` is the torque on a joint's output, `drag` the rate of its rotor's momentum. `out` and `alpha` go",
        "    with the accelerations `guess`; the torques fall by `yields` for each unit that the true ones are above.",
        '    """',
        "    g, moment = base(alpha, omega, p)",
        f"    I_T = inertia(p, int({PLATE}))",
        "    V_T = (omega[0], omega[1], omega[2], 0.0, 0.0, 0.0)",
        "    A_T = (0.0, 0.0, 0.0, -g[0], -g[1], -g[2])",
        "    F_T = add6(momentum(I_T, A_T), cross_force(V_T, momentum(I_T, V_T)), 1.0)",
    ]
    for j in range(n):
        c = carrier(structure, j)
        lines += [
            f"    V_{j} = add6(V_{c}, S_{j}, qd_{j})",
            f"    A_{j} = add6(A_{c}, cross_motion(V_{c}, S_{j}), qd_{j})",
            f"    F_{j} = add6(momentum(I_{j}, A_{j}), cross_force(V_{j}, momentum(I_{j}, V_{j})), 1.0)",
        ]
    lines += [
        f"    F_{c} = add6(F_{c}, rotor_moment(V_{c}, a_{j}, drag_{j}, momentum_{j}), 1.0)"
        for j in range(n)
        for c in [carrier(structure, j)]
    ]
    for j in reversed(range(n)):
        c = carrier(structure, j)
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
        lines += [
            "    omegad = (x0, x1, x2)",
            "    total = add6(total, momentum(I_T, (x0, x1, x2, 0.0, 0.0, 0.0)), 1.0)",
        ]
    else:
        lines.append("    omegad = (0.0, 0.0, 0.0)")
    wrench = ", ".join(f"-total[{i}]" for i in (3, 4, 5, 0, 1, 2))
    return [*lines, f"    return omegad, {unrolled('qdd_#', n)}, ({wrench})"]


def _solve(structure: Structure) -> list[str]:
    """Emit M x = b, the plate's angular acceleration (where it is free) before the joints'."""
    base = 3 if structure.elastic else 0
    size = base + structure.joints
    lines = []
    for j in range(size):
        for i in range(j, size):
            terms = "".join(f" - l{i}{m} * l{j}{m} * d{m}" for m in range(j))
            soft = f" + yields[{i + 3 - base}]" if i == j else ""
            value = f"{_mass(structure, i, j)}{soft}{terms}"
            lines.append(f"    d{j} = {value}" if i == j else f"    l{i}{j} = ({value}) / d{j}")
    for i in range(size):
        right = f"moment[{i}] - F_T[{i}]" if i < base else f"b_{i - base}"
        right += f" + yields[{i + 3 - base}] * guess[{i + 3 - base}]"
        lines.append(f"    x{i} = {right}" + "".join(f" - l{i}{m} * x{m}" for m in range(i)))
    for i in reversed(range(size)):
        lines.append(f"    x{i} = x{i} / d{i}" + "".join(f" - l{m}{i} * x{m}" for m in range(i + 1, size)))
    return [*lines, *[f"    qdd_{j} = x{base + j}" for j in range(structure.joints)]]


def _mass(structure: Structure, i: int, j: int) -> str:
    """Return element (i, j), i >= j, of the mass matrix; joints on different branches do not couple."""
    tensor = {(0, 0): 4, (1, 1): 5, (2, 2): 6, (1, 0): 7, (2, 0): 8, (2, 1): 9}
    base = 3 if structure.elastic else 0
    if i < base:
        return f"I_T[{tensor[i, j]}]"
    if j < base:
        return f"U_{i - base}[{j}]"
    above = i - base
    while above > j - base:
        above = structure.parents[above]
    return f"dot6(S_{j - base}, U_{i - base})" if above == j - base else "0.0"
