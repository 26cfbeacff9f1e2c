"""The signals of a simulated plant at its samples: what its effects see, and how its plate turns."""

from __future__ import annotations

from kbs_process.plant.compiled.multibody import carrier, joint_offset, placing
from kbs_process.plant.compiled.stepping import state_layout
from kbs_process.plant.structure import MICROSTEP, Structure
from kbs_process.rig.model import TRANSDUCER, Rig

OF_JOINTS = ("field", "rotor_angle", "rotor_rate", "joint_angle", "joint_rate")  # as in `effect.SIGNALS`


def plate_column(axis: str, signal: str = "angle") -> str:
    """Return the name of a tap's column: the plate's angle, or rate, about one of T's axes."""
    return f"{signal}.{TRANSDUCER}{axis}"


def tap_columns(rig: Rig) -> tuple[str, ...]:
    """Return the names of a tap's columns: SIGNAL.JOINT, signal by signal, then the plate's angles and rates."""
    plate = [plate_column(axis, signal) for signal in ("angle", "rate") for axis in "xyz"]
    return (*(f"{signal}.{joint}" for signal in OF_JOINTS for joint in rig.joint_names), *plate)


def taps_text(structure: Structure) -> list[str]:
    """Emit `tap`, which turns states, each with the fields behind it in microsteps, into the columns above."""
    n, layout = structure.joints, state_layout(structure)

    def part(name: str, i: int) -> str:
        return f"x[{layout[name].start + i}]"

    behind = max(part.stop for part in layout.values())
    lines = [
        '@njit(cache=True, nogil=True, error_model="numpy")',
        "def tap(states, p, out):",
        '    """Signals of all joints, then the plate\'s angles and their rates, a row for each state."""',
        "    for row in range(states.shape[0]):",
        "        x = states[row]",
        f"        alpha = triple(x, int({layout['alpha'].start}))",
        f"        omega_T = triple(x, int({layout['omega'].start}))",
        "        rates = plate_rates(alpha, omega_T)",
        f"        {placing(structure)} = place({', '.join(part('q', j) for j in range(n))}, p)",
    ]
    values = [f"floor(x[{behind + j}] + 0.5) / p[{joint_offset(structure, j) + MICROSTEP}]" for j in range(n)]
    values += [part("theta", j) for j in range(n)]
    for j in range(n):
        c = carrier(structure, j)
        values.append(f"{part('spin', j)} - dot3(a_{j}, omega_{c})")
        if j in structure.parents:
            lines.append(f"        omega_{j} = drift(omega_{c}, a_{j}, {part('qd', j)})")
    values += [part(name, j) for name in ("q", "qd") for j in range(n)]
    values += [f"{name}[{i}]" for name in ("alpha", "rates") for i in range(3)]
    return [*lines, *[f"        out[row, {i}] = {value}" for i, value in enumerate(values)], "", ""]
