"""Write the multibody equations of a tree of links on the transducer's plate, unrolled link by link.

Everything is in the plate's axes about T's origin (see `kernels`). Recursive Newton-Euler gives what acts
without acceleration, composite bodies give the mass matrix, an unrolled L D L^T factorisation the
accelerations; gravity enters as an upward acceleration of everything. Rotors are not in the mass matrix: a
rotor's spin follows from its own torque, and its carrier feels the change of its angular momentum.
(R. Featherstone, Rigid Body Dynamics Algorithms, 2008, chapters 5 and 6.)
"""

from __future__ import annotations

from functools import partial

from kbs_process.plant.effect import Port
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
    Load,
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
    loads = [load for load in structure.loads if load not in structure.mounts]
    parts = [_place(structure), _base(structure), *map(partial(_load, structure), loads)]
    return [line for part in [*parts, _accelerate(structure)] for line in [*part, "", ""]]


def placing(structure: Structure) -> str:
    """Return the call's result names of `place`: axis, screw and inertia of each link, then points of loads."""
    points = [f"r_{load.effect.name}" for load in structure.forces]
    return ", ".join([unrolled("a_#, S_#, I_#", structure.joints), *points])


def given(structure: Structure) -> list[str]:
    """Return what `accelerate` is given beside the base's angles and rates, as lines of names."""
    patterns = ["qd_#", "out_#", "drag_#", "momentum_#", *["ground_#"] * structure.grounded]
    extra = [["instant"], ["shaken"], ["mounted"]]
    wanted = [bool(structure.forces), bool(structure.shakes), bool(structure.mounts)]
    names = [name for part, needed in zip(extra, wanted, strict=True) if needed for name in part]
    return [placing(structure), *(unrolled(pattern, structure.joints) for pattern in patterns), *names]


def shaking(structure: Structure, instant: str) -> list[str]:
    """Return the sum of all accelerations of the floor, where there is one."""
    if not structure.shakes:
        return []
    sums = ["    shaken = (0.0, 0.0, 0.0)"]
    return sums + [f"    shaken = add3(shaken, load_{load.effect.name}({instant}, p))" for load in structure.shakes]


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
    for load in structure.forces:
        point = f"triple(p, int({structure.offset(load)}))"
        if load.link >= 0:
            point = f"add3(o_{load.link}, rotate(R_{load.link}, {point}))"
        lines.append(f"    r_{load.effect.name} = {point}")
    return [*lines, f"    return {placing(structure)}"]


def _load(structure: Structure, load: Load) -> list[str]:
    """Emit what one effect of the laboratory does: a force referred to T's origin, or the floor's acceleration."""
    effect, start = load.effect, structure.offset(load) + 3
    wires = {entry.name: f"p[{start + i}]" for i, entry in enumerate(effect.parameters)}
    call = f"effect_{effect.name}({', '.join(wires.get(name, name) for name in effect.arguments)})"
    if effect.port is Port.BASE_ACCELERATION:
        return ["@compiled", f"def load_{effect.name}(time, p):", f"    return {call}"]
    return [
        "@compiled",
        f"def load_{effect.name}(alpha, V, r, time, p):",
        "    x, y, z = from_plate(alpha, r)",
        "    vx, vy, vz = from_plate(alpha, velocity_at(V, r))",
        f"    return force_at(r, in_plate(alpha, {call}))",
    ]


def _base(structure: Structure) -> list[str]:
    """Emit gravity in the plate's axes and the moment of transducer and mounting on the plate."""
    field = f"triple(p, int({GRAVITY}))"
    beneath = _beneath(structure)
    if structure.shakes:  # on a floor that accelerates, everything falls the other way
        field = f"drift({field}, shaken, -1.0)"
    springs = [f"-p[{STIFFNESS + i}] * alpha[{i}] - p[{DAMPING + i}] * rates[{i}]" for i in range(3)]
    if structure.mounts:
        springs = [f"{spring} + mounted[{i}]" for i, spring in enumerate(springs)]
    return [
        "@compiled",
        f"def base(alpha, omega{beneath}, p):",
        '    """Gravity (m/s^2) and the moment of stiffness and damping on the plate (N m), in its axes."""',
        "    rates = plate_rates(alpha, omega)",
        f"    moment = plate_moment(alpha, ({', '.join(springs)}))",
        f"    return in_plate(alpha, {field}), moment",
    ]


def _beneath(structure: Structure) -> str:
    """Return what `base` is given of the laboratory."""
    return ", shaken" * bool(structure.shakes) + ", mounted" * bool(structure.mounts)


def _accelerate(structure: Structure) -> list[str]:
    n = structure.joints
    lines = [
        "@compiled",
        "def accelerate(",
        "    alpha, omega,",
        *[f"    {names}," for names in given(structure)],
        "    guess, yields, p,",
        "):",
        '    """Accelerations of plate and joints, and the wrench on the transducer, force first.',
        "",
        "    `out` is the torque on a joint's output, `drag` the rate of its rotor's momentum. `out` and `alpha` go",
        "    with the accelerations `guess`; the torques fall by `yields` for each unit that the true ones are above.",
        '    """',
        f"    g, moment = base(alpha, omega{_beneath(structure)}, p)",
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
    for load in structure.forces:
        name, link = load.effect.name, "T" if load.link < 0 else load.link
        lines.append(f"    F_{link} = add6(F_{link}, load_{name}(alpha, V_{link}, r_{name}, instant, p), -1.0)")
    for j in reversed(range(n)):
        c = carrier(structure, j)
        lines += [
            f"    U_{j} = momentum(I_{j}, S_{j})",
            f"    b_{j} = out_{j} - dot6(S_{j}, F_{j})",
            # What the ground reacts does not pass through the carrier.
            *[f"    F_{j} = add6(F_{j}, (*a_{j}, 0.0, 0.0, 0.0), -ground_{j})"] * structure.grounded,
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
