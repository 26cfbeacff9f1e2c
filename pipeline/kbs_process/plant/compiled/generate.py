"""Write the plant of one structure as a module: its joints unrolled, its effects called one by one."""

from __future__ import annotations

from collections.abc import Iterator

from kbs_process.plant.compiled.loop import LOOP
from kbs_process.plant.compiled.mounting import mounting_text, vector_of
from kbs_process.plant.compiled.multibody import joint_offset, multibody_text, placing, unrolled
from kbs_process.plant.compiled.stepping import accelerated, state_layout, stepping_text
from kbs_process.plant.compiled.taps import taps_text
from kbs_process.plant.effect import Effect, Port
from kbs_process.plant.structure import DRIVE, FIRST, JOINTS, MICROSTEP, RATIO, ROTOR, Structure


def module_text(structure: Structure) -> str:
    """Return the source of the plant's module."""
    return "\n".join(
        [
            *_head(structure),
            *_drive(structure),
            *_arriving(structure),
            *_late(structure),
            *multibody_text(structure),
            *mounting_text(structure),
            *stepping_text(structure),
            *_balance(structure),
            *taps_text(structure),
            LOOP,
        ]
    )


def _head(structure: Structure) -> list[str]:
    shape = f"parents {structure.parents}, {'elastic' if structure.elastic else 'rigid'} base"
    every = [*structure.effects, *(load.effect for load in structure.loads)]
    called = [effect for effect in every if not effect.delay]
    return [
        f'"""Generated: plant with {shape}, effects {", ".join(e.name for e in every)}."""',
        "import numpy as np",
        "from kbs_process.machine_code import njit",
        "from kbs_process.plant.compiled.kernels import (",
        "    add3, add6, add_inertia, chain, compiled, compiled_effect, cross3, cross_force, cross_motion, dot3, dot6,",
        "    drift, floor, force_at, from_plate, in_plate, inertia, joint_rotation, mean_rounded, momentum, placed,",
        "    plate_moment, plate_rates, rotate, rotor_moment, screw, triple, velocity_at, yielding,",
        ")",
        *[f"from {e.equation.__module__} import {e.equation.__qualname__} as _{e.name}" for e in called],
        *[f"from {e.slope.__module__} import {e.slope.__qualname__} as _slope_{e.name}" for e in called if e.slope],
        "",
        *[f"effect_{e.name} = compiled_effect(_{e.name})" for e in called],
        *[f"slope_{e.name} = compiled_effect(_slope_{e.name})" for e in called if e.slope],
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
    # The ground's share of the torque on the output comes last, where there is one.
    ground = ["ground"] * structure.grounded
    lines = [
        "@compiled",
        "def drive(field, rotor_angle, rotor_rate, rotor_travel, joint_angle, joint_rate,",
        f"          {'other_angle, other_rate, ' * structure.crossed}ratio, time, z, p, k):",
        '    """Motor torque less what slopes bear, Coulomb limit, gear and joint torque, then the states\' rates."""',
        *[f"    {total} = 0.0" for total in [*totals.values(), *ground]],
    ]
    rates: list[str] = []
    borne = []
    for effect, wires in _wired(structure):
        if effect.port is Port.FIELD:
            continue
        results = []
        for state in effect.states:
            wires[state.name] = f"z[{len(rates)}]"
            rates.append(f"{effect.name}_{state.name}")
            results.append(rates[-1])
        call = f"effect_{effect.name}({', '.join(wires.get(name, name) for name in effect.arguments)})"
        lines.append(f"    {', '.join(['value', *results])} = {call}")
        lines.append(f"    {totals.get(effect.port, 'joint')} += value")
        lines += ["    ground += value"] * (effect.port is Port.GROUND_TORQUE)
        if effect.slope:
            given = ", ".join(wires.get(name, name) for name in effect.arguments_of(effect.slope))
            borne.append(f"    motor -= gear * slope_{effect.name}({given})")
    return [*lines, *borne, f"    return {', '.join([*totals.values(), *rates, *ground])}", "", ""]


def _wired(structure: Structure) -> Iterator[tuple[Effect, dict[str, str]]]:
    """The effects of a drive, with the expressions of their parameters."""
    place = 0
    for effect in structure.effects:
        wires = {entry.name: f"p[k + {place + i}]" for i, entry in enumerate(effect.parameters)}
        place += len(wires)
        yield effect, wires


def _arriving(structure: Structure) -> list[str]:
    """Emit what becomes of the field on its way from the controller to the motor."""
    lines = [
        "@compiled",
        "def arriving(joint, field_0, field_1, time, H, p):",
        '    """Field that a motor has at the beginning of a step, in microsteps; `field_0` and 1 as commanded."""',
        f"    k = {JOINTS} + joint * {structure.stride}",
        f"    microsteps, ratio = p[k + {MICROSTEP}], p[k + {RATIO}]",
        f"    field_travel = (0.5 * (field_0 + field_1) - p[k + {FIRST}]) / microsteps",
        "    field_rate = (field_1 - field_0) / (H * microsteps)",
        f"    k += {DRIVE}",
        "    change = 0.0",
    ]
    for effect, wires in _wired(structure):
        if effect.port is Port.FIELD and not effect.delay:
            call = f"effect_{effect.name}({', '.join(wires.get(name, name) for name in effect.arguments)})"
            lines.append(f"    change += {call}")
    return [*lines, "    return field_0 + microsteps * change", "", ""]


def _late(structure: Structure) -> list[str]:
    """Emit where a field is as it arrives at its motor, which costs nothing where none comes late."""
    delays = [(effect.of_set_points, wires[effect.delay]) for effect, wires in _wired(structure) if effect.delay]
    on_its_way = [wire for set_points, wire in delays if not set_points]
    set_late = [wire for set_points, wire in delays if set_points]
    body = [f"    k = {JOINTS + DRIVE} + joint * {structure.stride}"] * bool(delays)
    if on_its_way:
        body += [f"    time = time - ({' + '.join(on_its_way)})", "    cycle = cycle_of(time, cycle, known, knots)"]
    if set_late:
        body += [
            f"    late = {' + '.join(set_late)}",
            "    began, ends = knots[cycle] - late, knots[cycle + 1] - late",
            "    before = field_at(began, cycle_of(began, cycle, known, knots), knots, fields, joint)",
            "    after = field_at(ends, cycle_of(ends, cycle, known, knots), knots, fields, joint)",
            "    return before + (time - knots[cycle]) / (knots[cycle + 1] - knots[cycle]) * (after - before)",
        ]
    else:
        body += ["    return field_at(time, cycle, knots, fields, joint)"]
    return [
        "@compiled",
        "def field_late(time, cycle, known, knots, fields, joint, p):",
        '    """Field position of a motor, in microsteps, as it arrives there; `cycle` is that of the time itself."""',
        *body,
        "",
        "",
    ]


def _balance(structure: Structure) -> list[str]:
    """Emit the accelerations at rest, which vanish in static equilibrium."""
    layout = state_layout(structure)
    n, z = structure.joints, len(structure.states)
    lines = [
        '@njit(cache=True, nogil=True, error_model="numpy")',
        "def balance(x, field, p, acceleration):",
        '    """Accelerations at rest of base, outputs and rotors, less Coulomb friction; return the wrench."""',
        f"    alpha = triple(x, int({layout['alpha'].start}))",
        "    omega = (0.0, 0.0, 0.0)",
        *[f"    q_{j} = x[{layout['q'].start + j}]\n    qd_{j} = 0.0" for j in range(n)],
        f"    {placing(structure)} = place({unrolled('q_#', n)}, p)",
        *["    instant = 0.0"] * bool(structure.forces),
        *["    shaken = (0.0, 0.0, 0.0)"] * bool(structure.shakes),
        *_held(structure),
    ]
    for j in range(n):
        k = joint_offset(structure, j)
        earth = [f"ground_{j}"] * structure.grounded
        states = vector_of([f"x[{layout['z'].start + i}]" for i in range(j * z, (j + 1) * z)])
        rotor = f"x[{layout['theta'].start + j}]"
        other = f"q_{structure.other(j)}, 0.0, " * structure.crossed
        lines += [
            f"    field_{j} = floor(field[{j}] + 0.5) / p[{k + MICROSTEP}]",
            f"    {', '.join(['motor', '_', 'gear', 'joint', *['_'] * z, *earth])} = drive(",
            f"        field_{j}, {rotor}, 0.0, 0.0, q_{j}, 0.0, {other}p[{k + RATIO}], 0.0, {states},",
            f"        p, int({k + DRIVE})",
            "    )",
            f"    out_{j} = gear + joint",
            f"    drag_{j} = motor - gear / p[{k + RATIO}]",
            f"    momentum_{j} = 0.0",
        ]
    lines.append(f"    guess = yields = (0.0, 0.0, 0.0{', 0.0' * n})")
    lines += accelerated(structure)
    names = [f"omegad[{i}]" for i in range(3)] + [f"qdd_{j}" for j in range(n)]
    names += [f"drag_{j} / p[{joint_offset(structure, j) + ROTOR}]" for j in range(n)]
    lines += [f"    acceleration[{i}] = {name}" for i, name in enumerate(names)]
    return [*lines, "    return wrench", "", ""]


def _held(structure: Structure) -> list[str]:
    """Emit the mounting's moment at rest."""
    if not structure.mounts:
        return []
    first = state_layout(structure)["y"].start
    y = vector_of([f"x[{first + i}]" for i in range(len(structure.mounted))])
    return [f"    mounted, _ = mounting(alpha, omega, {y}, 0.0, p)"]
