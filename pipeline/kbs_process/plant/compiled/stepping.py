"""Write the step of the plant: the multibody part once, each rotor `ROTOR_STEPS` times within it.

The multibody part turns at frequencies far below the rotors' and gets steps of its own, of position Verlet
(positions drift half a step, momenta get the step's impulse, positions drift the other half) with the force
that Stoermer and Cowell's method wants: the one at positions ahead by a H^2/12, a being the acceleration.
That makes the frequencies right to (omega H)^4 / 480, and solved for a with the stiffness of base and gears
(Newmark's method with beta = 1/12) it is stable up to omega H = 2.4. The dampers act at the mean rate.

The rotors turn against the outputs' parabolas, the field's staircase averaged over each of their steps. The
velocity-dependent torque, whose slope reaches 2e4 1/s at standstill, is integrated exponentially, along the
secant between the rates before and after; Coulomb friction exactly: the rotor stands where it can hold it.
The carriers get the change of the rotors' momenta to the last bit, the outputs the mean torque of their gears.
States that follow an output's angle, as bristles do, are led along its parabola, and set right with the acceleration.
(E. Hairer, C. Lubich, G. Wanner, Geometric Numerical Integration, 2006, chapters I, VIII and XIII.)
"""

from __future__ import annotations

from kbs_process.plant.compiled.mounting import vector_of
from kbs_process.plant.compiled.multibody import carrier, given, joint_offset, placing, shaking, unrolled
from kbs_process.plant.structure import DAMPING, DRIVE, MICROSTEP, RATIO, ROTOR, STIFFNESS, Structure

ROTOR_STEPS = 10
NUDGE = 1e-6  # rad, rad/s: difference that gives a slope; effects need no derivatives


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
        "omegad": 3,  # accelerations of the step before, which predict those of the next
        "qdd": n,
        "z": n * z,  # the effects' own states, drive by drive
        "zd": n * z,
        "y": len(structure.mounted),  # the mounting's own states, in the middle of the step before
    }
    layout, start = {}, 0
    for name, size in sizes.items():
        layout[name] = slice(start, start + size)
        start += size
    return layout


class InVector:
    """How a step's text names the numbers of the state: x[i]."""

    def __init__(self, structure: Structure) -> None:
        self.layout = state_layout(structure)

    def at(self, name: str, i: int = 0) -> str:
        """One number of a part."""
        return self.place(self.layout[name].start + i)

    def vector(self, name: str) -> str:
        """Three numbers of a part."""
        return vector_of([self.at(name, i) for i in range(3)])

    def place(self, i: int) -> str:
        """Number `i` of all."""
        return f"x[{i}]"


def stepping_text(structure: Structure) -> list[str]:
    """Return `turn_rotor` and `step`."""
    return [*_rotor(structure), "", "", *_step(structure), "", ""]


def accelerated(structure: Structure) -> list[str]:
    """Return the call that solves for the accelerations."""
    return [
        f"    omegad, {unrolled('qdd_#', structure.joints)}, wrench = accelerate(",
        "        alpha, omega,",
        *[f"        {names}," for names in given(structure)],
        "        guess, yields, p,",
        "    )",
    ]


def _rotor(structure: Structure) -> list[str]:
    """Emit the motion of a rotor through one step of its own."""
    z = len(structure.states)
    rates = [f"d{i}" for i in range(z)]
    unused = ["_"] * z
    other = "other_angle, other_rate, " * structure.crossed
    ground, ground_1 = (["ground"], ["ground_1"]) if structure.grounded else ([], [])
    earth = ", 0.5 * (ground + ground_1)" * structure.grounded
    state = vector_of([f"z[{i}] + 0.5 * h * zd[{i}]" for i in range(z)])
    after = vector_of([f"z[{i}] + h * d{i}" for i in range(z)])

    def drive(results: list[str], w: str) -> str:
        given = f"field, middle, {w}, h * w, angle, rate, {other}ratio, time, state, p, k + {DRIVE}"
        return f"{', '.join(results)} = drive({given})"

    secant = [
        "    drop = mobility * (motor_1 - gear_1 / ratio - (motor - gear / ratio))",
        "    impulse = mobility * yielding(w_1 - w, drop)",
        "    free = w + impulse * torque",
        "    w_1 = free - max(-impulse * limit, min(impulse * limit, free))",
        "    " + drive(["motor_1", "_", "gear_1", "joint_1", *unused, *ground_1], "w_1"),
    ]
    return [
        "@compiled",
        f"def turn_rotor(theta, w, carrier_rate, field, angle, rate, {other}time, h, z, zd, p, k):",
        '    """Angle and rate after `h`, mean torque on the output, the effects\' states and their rates.',
        "",
        "    `carrier_rate` is the carrier's acceleration about the rotor's axis, `angle` and `rate` the output's in",
        "    the middle of the step, `field` the mean over it. Another joint moves as in the middle of the whole step.",
        '    """',
        f"    ratio = p[k + {RATIO}]",
        f"    mobility = h / p[k + {ROTOR}]",
        "    middle = theta + 0.5 * h * w",
        f"    state = {state}",
        "    " + drive(["motor", "limit", "gear", "joint", *rates, *ground], "w"),
        f"    w_1 = w + {NUDGE}",
        "    " + drive(["motor_1", "_", "gear_1", "joint_1", *unused, *ground_1], "w_1"),
        f"    torque = motor - gear / ratio - p[k + {ROTOR}] * carrier_rate",
        *secant,
        *secant[:-1],
        "    output = 0.5 * (gear + joint + gear_1 + joint_1)",
        f"    return middle + 0.5 * h * w_1, w_1, output, {after}, {vector_of(rates)}{earth}",
    ]


def _step(structure: Structure) -> list[str]:
    state = InVector(structure)
    return [
        "@compiled",
        "def step(x, field_0, field_1, time, H, p):",
        '    """Advance the state `x` by H; return the mean wrench over the step, force first."""',
        *drifted(structure, state),
        *prepared(structure, state),
        f"    for i in range({ROTOR_STEPS}):",
        *(f"    {line}" for line in turned(structure, state)),
        *handed_over(structure, state),
        *kicked(structure, state),
        "    return wrench",
    ]


def drifted(structure: Structure, state: InVector) -> list[str]:
    """Emit positions, rates and geometry in the middle of the step."""
    n = structure.joints
    qdd = [state.at("qdd", j) for j in range(n)]
    lines = [
        "    half = 0.5 * H",
        "    ahead = H * H / 12.0",
        f"    alpha_0 = {state.vector('alpha')}",
        f"    omega_0 = {state.vector('omega')}",
        f"    omegad_T = {state.vector('omegad')}",
        f"    guess = (omegad_T[0], omegad_T[1], omegad_T[2], {', '.join(qdd)})",
        "    drifted = drift(alpha_0, plate_rates(alpha_0, omega_0), half)",
        "    alpha = drift(drifted, omegad_T, ahead)",
        "    omega = omega_T = drift(omega_0, omegad_T, half)",
    ]
    for j in range(n):
        # The middle of the parabola through which the output passes is below its mean, which is `ahead`.
        lines += [
            f"    drifted_{j} = {state.at('q', j)} + half * {state.at('qd', j)}",
            f"    q_{j} = drifted_{j} + 0.5 * ahead * {qdd[j]}",
            f"    qd_{j} = {state.at('qd', j)} + half * {qdd[j]}",
        ]
    return [*lines, f"    {placing(structure)} = place({unrolled('q_#', n)}, p)"]


def prepared(structure: Structure, state: InVector) -> list[str]:
    """Emit what the rotors begin the step with."""
    z = len(structure.states)
    lines = [f"    h = H / {ROTOR_STEPS}"]
    for j in range(structure.joints):
        c, k, qdd = carrier(structure, j), joint_offset(structure, j), state.at("qdd", j)
        own = range(j * z, (j + 1) * z)
        if j in structure.parents:
            lines += [
                f"    omega_{j} = drift(omega_{c}, a_{j}, qd_{j})",
                f"    turning = drift(omegad_{c}, a_{j}, {qdd})",
                f"    omegad_{j} = drift(turning, cross3(omega_{c}, a_{j}), qd_{j})",
            ]
        lines += [
            f"    carrier_{j} = dot3(a_{j}, omega_{c})",
            f"    turning_{j} = dot3(a_{j}, omegad_{c})",
            f"    spin_{j} = {state.at('spin', j)}",
            f"    theta_{j} = {state.at('theta', j)}",
            f"    w_{j} = spin_{j} - (carrier_{j} - half * turning_{j})",
            f"    z_{j} = {vector_of([state.at('z', i) for i in own])}",
            f"    zd_{j} = {vector_of([state.at('zd', i) for i in own])}",
            f"    share_{j} = (field_1[{j}] - field_0[{j}]) / {ROTOR_STEPS}",
            f"    inverse_{j} = 1.0 / share_{j}",
            f"    begin_{j} = arriving({j}, field_0[{j}], field_1[{j}], time, H, p)",
            f"    pitch_{j} = 1.0 / p[{k + MICROSTEP}]",
            f"    out_{j} = 0.0",
            *[f"    ground_{j} = 0.0"] * structure.grounded,
        ]
    return lines


def turned(structure: Structure, state: InVector) -> list[str]:
    """Emit one of the rotors' steps: side by side, so that the processor need not wait for one of them."""
    lines = ["    off = (i + 0.5) * h - half"]
    for j in range(structure.joints):
        k, qdd, o = joint_offset(structure, j), state.at("qdd", j), structure.other(j)
        other = f"q_{o}, qd_{o}, " * structure.crossed
        lines += [
            f"    from_ = begin_{j} + i * share_{j}",
            f"    field = mean_rounded(from_, from_ + share_{j}, inverse_{j}) * pitch_{j}",
            f"    angle = q_{j} + off * (qd_{j} + 0.5 * off * {qdd})",
            f"    rate = qd_{j} + off * {qdd}",
            f"    theta_{j}, w_{j}, out, z_{j}, zd_{j}{', earth' * structure.grounded} = turn_rotor(",
            f"        theta_{j}, w_{j}, turning_{j}, field, angle, rate, {other}time + half + off, h,",
            f"        z_{j}, zd_{j}, p, int({k}),",
            "    )",
            f"    out_{j} += out / {ROTOR_STEPS}",
            *[f"    ground_{j} += earth / {ROTOR_STEPS}"] * structure.grounded,
        ]
    return lines


def handed_over(structure: Structure, state: InVector) -> list[str]:
    """Emit the rotors' states after the step, and the change of their momenta, which their carriers get."""
    z = len(structure.states)
    lines = []
    for j in range(structure.joints):
        k, own = joint_offset(structure, j), range(j * z, (j + 1) * z)
        lines += [
            f"    {state.at('spin', j)} = w_{j} + (carrier_{j} + half * turning_{j})",
            f"    {state.at('theta', j)} = theta_{j}",
            f"    drag_{j} = p[{k + ROTOR}] * ({state.at('spin', j)} - spin_{j}) / H",
            f"    momentum_{j} = p[{k + ROTOR}] * 0.5 * ({state.at('spin', j)} + spin_{j})",
            *[f"    {state.at('z', i)} = z_{j}[{m}]" for m, i in enumerate(own)],
            *[f"    {state.at('zd', i)} = zd_{j}[{m}]" for m, i in enumerate(own)],
        ]
    return lines


def kicked(structure: Structure, state: InVector) -> list[str]:
    """Emit the multibody part's accelerations, and the end of its step."""
    n, z = structure.joints, len(structure.states)
    units = [one.unit for effect in structure.effects for one in effect.states]
    lines = []
    for j in range(n):
        k, o = joint_offset(structure, j), structure.other(j)

        def gear(tag: str, angle: str, rate: str, own: str = f"z_{j}", j: int = j, k: int = k, o: int = o) -> str:
            rotor, other = f"0.0, theta_{j}, w_{j}, 0.0", f"q_{o}, qd_{o}, " * structure.crossed
            given = f"{rotor}, {angle}, {rate}, {other}p[{k + RATIO}], time + half, {own}, p, int({k + DRIVE})"
            rates = [f"d{i}{tag}" for i in range(z)]
            results = ", ".join(["_", "_", f"gear{tag}", f"joint{tag}", *rates, *["_"] * structure.grounded])
            return f"    {results} = drive({given})"

        # A state that follows the angle, as bristles do, is a spring: with the angle it would have moved, too.
        moved = vector_of([f"z_{j}[{i}] + follows_{j}[{i}]" for i in range(z)])
        lines += [
            gear("", f"q_{j}", f"qd_{j}"),
            gear("_qd", f"q_{j}", f"qd_{j} + {NUDGE}"),
            f"    follows_{j} = {vector_of([f'd{i}_qd - d{i}' for i in range(z)])}",
            gear("_q", f"q_{j} + {NUDGE}", f"qd_{j}", moved),
            "    stiffness = gear + joint - gear_q - joint_q",
            "    damping = gear + joint - gear_qd - joint_qd",
            f"    yields_{j} = max(0.0, ahead * stiffness + half * damping) / {NUDGE}",
        ]
    base = [f"ahead * p[{STIFFNESS + i}] + half * p[{DAMPING + i}]" for i in range(3)]
    if structure.mounts:
        lines += _mounted(structure, state)
        base = [f"{spring} + yielding_T[{i}]" for i, spring in enumerate(base)]
    lines.append(f"    yields = ({', '.join(base)}, {unrolled('yields_#', n)})")
    lines += ["    instant = time + half"] * bool(structure.loads)
    lines += [*shaking(structure, "instant"), *accelerated(structure)]
    if structure.elastic:
        for i in range(3):
            lines += [f"    {state.at('omegad', i)} = omegad[{i}]", f"    {state.at('omega', i)} += H * omegad[{i}]"]
        lines.append(f"    drifted = drift(drifted, plate_rates(alpha, {state.vector('omega')}), half)")
        lines += [f"    {state.at('alpha', i)} = drifted[{i}]" for i in range(3)]
    for j in range(n):
        # The rotors' steps took the output along the parabola of the acceleration before. The new one's ends as far
        # before the output's true place, by which the next step begins.
        own = range(j * z, (j + 1) * z)
        lines += [f"    late = 5.0 * ahead * (qdd_{j} - {state.at('qdd', j)}) / {NUDGE}"] * bool(z)
        for m, (i, unit) in enumerate(zip(own, units, strict=True)):
            lines.append(f"    right = {state.at('z', i)} + follows_{j}[{m}] * late")
            if unit == "1":
                # A share, which slopes of one direction would lead beyond its end.
                lines.append(f"    most = max(1.0, abs({state.at('z', i)}))")
                lines.append("    right = max(-most, min(most, right))")
            lines.append(f"    {state.at('z', i)} = right")
        lines += [
            f"    {state.at('qdd', j)} = qdd_{j}",
            f"    {state.at('qd', j)} += H * qdd_{j}",
            f"    {state.at('q', j)} = drifted_{j} + half * {state.at('qd', j)}",
        ]
    return lines


def _mounted(structure: Structure, state: InVector) -> list[str]:
    """Emit the mounting's moment, and its states in the middle of the step."""
    own = range(len(structure.mounted))
    at_start = f"{state.vector('alpha')}, {state.vector('omega')}"
    lines = [
        f"    y = {vector_of([state.at('y', i) for i in own])}",
        "    leading = (guess[0], guess[1], guess[2])",
        f"    mounted, yielding_T, y = mount({at_start}, alpha, omega, leading, y, time, H, p)",
    ]
    return lines + [f"    {state.at('y', i)} = y[{i}]" for i in own]
