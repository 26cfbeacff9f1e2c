"""Write what the mounting does beyond the transducer's linear springs: moments that may have states of their own.

In position Verlet the plate's angles in the middle of the steps follow each other by the rates at their ends. States
go along, from one middle to the next, exponentially, along the secant to where they would go without settling: a slip
angle that is turned through within a step bounds it by accuracy, not by stability. Stoermer and Cowell's method wants
the moment a little ahead (see `stepping`), and how it yields: with the states that would be there.
"""

from __future__ import annotations

from kbs_process.plant.structure import Structure

NUDGE = 1e-6  # rad, rad/s, units of states: difference that gives a slope
_SIGNALS = {
    f"base_{kind}{axis}": f"{name}[{i}]"
    for kind, name in (("", "alpha"), ("rate_", "rates"))
    for i, axis in enumerate("xyz")
}


def mounting_text(structure: Structure) -> list[str]:
    """Return `mounting` (moment, and rates of states) and `mount` (the same in the middle of a step)."""
    if not structure.mounts:
        return []
    return [*_mounting(structure), "", "", *_mount(len(structure.mounted)), "", ""]


def vector_of(expressions: list[str]) -> str:
    """Return a tuple of some expressions; the compiler wants one that is not empty."""
    return f"({', '.join(expressions or ['0.0'])},)"


def _mounting(structure: Structure) -> list[str]:
    lines = [
        "@compiled",
        "def mounting(alpha, rates, y, time, p):",
        '    """Moment of the mounting on the plate about the base\'s axes, and the rates of its states."""',
        "    moment = (0.0, 0.0, 0.0)",
    ]
    derivatives: list[str] = []
    for load in structure.mounts:
        effect, start = load.effect, structure.offset(load) + 3
        wires = _SIGNALS | {entry.name: f"p[{start + i}]" for i, entry in enumerate(effect.parameters)}
        own = []
        for state in effect.states:
            wires[state.name] = f"y[{len(derivatives)}]"
            derivatives.append(f"d{len(derivatives)}")
            own.append(derivatives[-1])
        call = f"effect_{effect.name}({', '.join(wires.get(name, name) for name in effect.arguments)})"
        lines += [
            f"    {', '.join(['m_x', 'm_y', 'm_z', *own])} = {call}",
            "    moment = add3(moment, (m_x, m_y, m_z))",
        ]
    return [*lines, f"    return moment, {vector_of(derivatives)}"]


def _mount(states: int) -> list[str]:
    every = range(states)
    ahead = vector_of([f"y[{i}] + H * d[{i}]" for i in every])
    after = vector_of([f"y[{i}] + H * d[{i}] * yielding(d[{i}], e[{i}] - d[{i}])" for i in every])
    led = vector_of([f"y[{i}] + H * (e[{i}] - d[{i}])" for i in every])
    yields = [
        f"max(0.0, ahead * (moment[{i}] - turned[{i}]) + half * (moment[{i}] - faster[{i}])) / {NUDGE}"
        for i in range(3)
    ]
    return [
        "@compiled",
        "def mount(alpha_0, omega_0, alpha, omega, omegad, y, time, H, p):",
        '    """The mounting\'s moment in the middle of a step, what it yields there, and its states.',
        "",
        "    `alpha_0` and `omega_0` are those at the step's beginning, `y` the states in the middle of the last.",
        '    """',
        "    half = 0.5 * H",
        "    ahead = H * H / 12.0",
        f"    apart = ({NUDGE}, {NUDGE}, {NUDGE})",
        "    between = plate_rates(alpha_0, omega_0)",
        "    _, d = mounting(alpha_0, between, y, time, p)",
        f"    _, e = mounting(alpha_0, between, {ahead}, time, p)",
        f"    y = {after}",
        "    rates = plate_rates(alpha, omega)",
        "    led = drift(rates, omegad, H / 12.0)",
        "    _, d = mounting(alpha, rates, y, time + half, p)",
        "    _, e = mounting(alpha, led, y, time + half, p)",
        f"    moment, _ = mounting(alpha, rates, {led}, time + half, p)",
        f"    faster, _ = mounting(alpha, add3(rates, apart), {led}, time + half, p)",
        "    _, e = mounting(alpha, drift(led, apart, 1.0 / H), y, time + half, p)",
        f"    turned, _ = mounting(add3(alpha, apart), rates, {led}, time + half, p)",
        f"    return moment, ({', '.join(yields)}), y",
    ]
