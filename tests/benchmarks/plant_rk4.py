"""The generated plant as a right-hand side for RK4: the form in which it can be compared with plant_rk4.c."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from pathlib import Path
from typing import Any

from kbs_process.plant.compiled.generate import module_text
from kbs_process.plant.compiled.multibody import carrier, joint_offset, unrolled
from kbs_process.plant.compiled.stepping import accelerated, state_layout
from kbs_process.plant.structure import DRIVE, MICROSTEP, RATIO, ROTOR, Structure

LOOP = '''
@njit(cache=True, error_model="numpy", fastmath={"contract", "arcp", "nsz", "nnan", "ninf"})
def run(p, x, steps, h, cycle, fields, every, width, out):
    """Classical RK4 at a fixed step; the field, in microsteps, moves linearly between `cycles` and is rounded."""
    at = (0.0, 0.5, 0.5, 1.0)
    weight = (1.0, 2.0, 2.0, 1.0)
    n = x.shape[0]
    y, k, total, field = np.empty(n), np.zeros(n), np.empty(n), np.empty(fields.shape[1])
    for step in range(steps):
        total[:] = 0.0
        for stage in range(4):
            t = (step + at[stage]) * h / cycle
            c = int(t)
            for j in range(field.shape[0]):
                field[j] = floor(fields[c, j] + (t - c) * (fields[c + 1, j] - fields[c, j]) + 0.5)
            for i in range(n):
                y[i] = x[i] + at[stage] * h * k[i]
            wrench = rates(y, field, width, p, k)
            if stage == 0 and step % every == 0:
                for i in range(6):
                    out[step // every, i] = wrench[i]
            for i in range(n):
                total[i] += weight[stage] * k[i]
        for i in range(n):
            x[i] += h / 6.0 * total[i]
'''


def compiled_rk4(structure: Structure, folder: Path) -> Callable[..., Any]:
    """Return `run` of the plant of `structure`, written into `folder`."""
    path = folder / "plant_rk4_form.py"
    path.write_text(module_text(structure) + "\n\n" + "\n".join(_rates(structure)) + LOOP)
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    run: Callable[..., Any] = module.run
    return run


def _rates(structure: Structure) -> list[str]:
    """Emit the right-hand side; the sign of Coulomb friction is a ramp of half width `width`, as RK4 needs."""
    layout, n = state_layout(structure), structure.joints
    zero = "(0.0, 0.0, 0.0" + ", 0.0" * n + ")"
    lines = [
        "@compiled",
        "def rates(x, field, width, p, dx):",
        f"    alpha = triple(x, {layout['alpha'].start})",
        f"    omega = omega_T = triple(x, {layout['omega'].start})",
    ]
    for j in range(n):
        lines += [f"    q_{j} = x[{layout['q'].start + j}]", f"    qd_{j} = x[{layout['qd'].start + j}]"]
    lines.append(f"    {unrolled('a_#, S_#, I_#', n)} = place({unrolled('q_#', n)}, p)")
    for j in range(n):
        c, k = carrier(structure, j), joint_offset(structure, j)
        theta, spin = layout["theta"].start + j, layout["spin"].start + j
        lines += [
            f"    omega_{j} = drift(omega_{c}, a_{j}, qd_{j})",
            f"    w = x[{spin}] - dot3(a_{j}, omega_{c})",
            f"    motor, limit, gear, joint = drive(field[{j}] / p[{k + MICROSTEP}], x[{theta}], w, 0.0,",
            f"        q_{j}, qd_{j}, p[{k + RATIO}], 0.0, (0.0,), p, {k + DRIVE})",
            f"    out_{j} = gear + joint",
            f"    drag_{j} = motor - gear / p[{k + RATIO}] - limit * max(-1.0, min(1.0, w / width))",
            f"    momentum_{j} = p[{k + ROTOR}] * x[{spin}]",
            f"    dx[{theta}] = w",
            f"    dx[{spin}] = drag_{j} / p[{k + ROTOR}]",
        ]
    lines += [f"    guess = yields = {zero}", *accelerated(structure), "    turning = plate_rates(alpha, omega)"]
    for i in range(3):
        lines += [
            f"    dx[{layout['alpha'].start + i}] = turning[{i}]",
            f"    dx[{layout['omega'].start + i}] = omegad[{i}]",
        ]
    for j in range(n):
        lines += [f"    dx[{layout['q'].start + j}] = qd_{j}", f"    dx[{layout['qd'].start + j}] = qdd_{j}"]
    return [*lines, "    return wrench", "", ""]
