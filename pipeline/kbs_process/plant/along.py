"""An effect along given signals, without the plant: what a unit of each of its amplitudes does at its port.

To first order a left-out effect acts along the motion that the plant has without it. Its equation, the very one that
the plant compiles, is called sample by sample in a small generated module of its own; its states are integrated along
the same signals.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np

from kbs_process.plant.compiled.compile import compiled_module
from kbs_process.plant.effect import Effect, Parameter, Port, State
from kbs_process.signals.records import Array

# Rates are the slopes of these between samples, not their instants there, at which a microstep's ripple would alias.
SLOPES = {
    "field_rate": "field",
    "rotor_rate": "rotor_angle",
    "joint_rate": "joint_angle",
    "other_rate": "other_angle",
    "vx": "x",
    "vy": "y",
    "vz": "z",
    "base_rate_x": "base_x",
    "base_rate_y": "base_y",
    "base_rate_z": "base_z",
}
TRAVELS = {"rotor_travel": "rotor_angle", "field_travel": "field"}
SLIDING = 1e-3  # rad/s of the rotor at which a Coulomb friction along given signals is full
FINEST = 32  # parts of an interval
ENOUGH = 0.03  # change of the result, by twice as many parts, that ends their doubling
STIFFEST = 1.5  # of a state's rate of decay, in a part: Runge and Kutta's fourth-order method bears 2.8


def signals_of(effect: Effect) -> tuple[str, ...]:
    """Return the signals that `along` needs for an effect."""
    declared: list[Parameter | State] = [*effect.parameters, *effect.states]
    own = {entry.name for entry in declared} | {"ratio"}
    asked = [name for name in effect.arguments if name not in own]
    if effect.port is Port.MOTOR_FRICTION:
        asked.append("rotor_rate")
    based = [(SLOPES | TRAVELS).get(name, name) for name in asked]
    return tuple(dict.fromkeys(based)) or ("time",)


def along(effect: Effect, signals: Mapping[str, Array], values: Mapping[str, float], dt: float) -> Array:
    r"""Return the value of `effect` for a unit of each amplitude, shape (n, amplitudes, components).

    `signals` has those of `signals_of`, (n,) each, `dt` s apart; `values` the parameters that are no amplitudes, and
    "ratio" where asked for. Row k is the mean over the interval from sample k to k + 1, between which the signals are
    taken as linear; the last row repeats the one before. So what is faster than the samples averages out and does not
    alias.
    Units: the port's, for 1 in the unit of the amplitude. Friction (`Port.MOTOR_FRICTION`) is given as the torque of a
        sliding rotor, $-T \operatorname{sign} \omega_r$.
    Validity: 3 % of the whole, or where 32 parts of an interval end the search: orders beyond 60 radians in a sample.
    """
    module = _module(effect)
    columns = np.ascontiguousarray(np.stack([signals[name] for name in signals_of(effect)], axis=1))
    given = np.array([values[name] for name in _given(effect)], dtype=float)
    shape = (len(columns), len(_amplitudes(effect)), effect.port.components)

    def at(parts: int) -> Array:
        out = np.zeros(shape)
        module(columns, given, dt, parts, out)
        return out

    parts = 1
    if effect.states:
        fastest = module(columns, given, dt, 0, np.zeros(shape))
        parts = int(np.clip(np.ceil(fastest * dt / STIFFEST), 1, 8 * FINEST))
    coarse = at(parts)
    while parts < FINEST:
        parts *= 2
        fine = at(parts)
        if np.linalg.norm(fine - coarse) <= ENOUGH * np.linalg.norm(fine):
            return fine
        coarse = fine
    return coarse


def _amplitudes(effect: Effect) -> list[str]:
    return [entry.name for entry in effect.amplitudes]


def _given(effect: Effect) -> list[str]:
    """Numbers that stay the same along the signals, in the order in which the module wants them."""
    names = [entry.name for entry in effect.parameters if entry.role != "amplitude"]
    return [*names, *(["ratio"] if "ratio" in effect.arguments else [])]


@cache
def _module(effect: Effect) -> Callable[..., Any]:
    source = inspect.getmodule(effect.equation)
    run: Callable[..., Any] = compiled_module("along", along_text(effect), [source]).run
    return run


def along_text(effect: Effect) -> str:
    """Return the source of the module that runs one effect along signals."""
    states = [state.name for state in effect.states]
    amplitudes = _amplitudes(effect)

    def call(amplitude: str | None) -> str:
        wires = {name: f"values[{i}]" for i, name in enumerate(_given(effect))}
        wires |= {name: "1.0" if name == amplitude else "0.0" for name in amplitudes}
        return f"equation({', '.join(wires.get(name, name) for name in effect.arguments)})"

    column = {name: c for c, name in enumerate(signals_of(effect))}
    lines_of = {name: f"{name} = at(signals, i, share, {c})" for name, c in column.items()}
    lines_of |= {rate: f"{rate} = slope(signals, i, {column[of]}) / dt" for rate, of in SLOPES.items() if of in column}
    if "rotor_angle" in column:
        lines_of["rotor_travel"] = f"rotor_travel = slope(signals, i, {column['rotor_angle']}) / max(parts, 1)"
    if "field" in column:
        c = column["field"]
        lines_of["field_travel"] = f"field_travel = at(signals, i, share, {c}) - signals[0, {c}]"
    wired = {*effect.arguments, *(["rotor_rate"] if effect.port is Port.MOTOR_FRICTION else [])}
    signals = [line for name, line in lines_of.items() if name in wired]
    lines = [
        f'"""Generated: {effect.name} along signals."""',
        "from kbs_process.machine_code import njit",
        "from kbs_process.plant.compiled.elementary import linked",
        f"from {effect.equation.__module__} import {effect.equation.__qualname__} as _equation",
        "",
        "# Neither entries from Python nor the plant's own sine: half the time to compile.",
        'compiled = njit(error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)',
        "equation = linked(_equation, compiled)",
        "",
        "",
        "@compiled",
        "def slope(signals, i, c):",
        "    return signals[i + 1, c] - signals[i, c]",
        "",
        "",
        "@compiled",
        "def at(signals, i, share, c):",
        "    return signals[i, c] + share * slope(signals, i, c)",
        "",
        "",
    ]
    if states:
        derivative = ", ".join(f"d_{name}" for name in states)
        lines += [
            "@compiled",
            f"def rates(signals, values, dt, i, share, parts, {', '.join(states)}):",
            *[f"    {line}" for line in signals],
            f"    {'_, ' * effect.port.components}{derivative} = {call(None)}",
            f"    return {derivative},",
            "",
            "",
        ]
    lines += [
        '@njit(cache=True, nogil=True, error_model="numpy")',
        "def run(signals, values, dt, parts, out):",
        '    """Means over each interval, from its parts; with none, the fastest of the states, 1/s."""',
        "    n = signals.shape[0]",
        "    fastest = 0.0",
        *[f"    {state.name} = {state.initial!r}" for state in effect.states],
        *(_fastest(effect.states) if states else []),
        "    h = dt / max(parts, 1)",
        "    for i in range(n - 1):",
        "        for part in range(parts):",
        "            share = (part + 0.5) / parts",
        *[f"            {line}" for line in (_stepped(states) if states else [])],
        *[f"            {line}" for line in signals],
    ]
    for index, amplitude in enumerate(amplitudes):
        value = f"{call(amplitude)}[0]" if states and effect.port.of_drive else call(amplitude)
        if effect.port is Port.MOTOR_FRICTION:
            value = f"-max(-1.0, min(1.0, rotor_rate / {SLIDING!r})) * {value}"
        if effect.port.of_drive:
            lines.append(f"            out[i, {index}, 0] += {value} / parts")
            continue
        lines.append(f"            vector = {value}")
        lines += [f"            out[i, {index}, {d}] += vector[{d}] / parts" for d in range(3)]
    lines += [f"            {name} = next_{name}" for name in states]
    return "\n".join([*lines, "    out[n - 1] = out[n - 2]", "    return fastest", ""])


def _fastest(states: Sequence[State]) -> list[str]:
    """Emit a bound on the states' rates of decay and pulsations, along all samples.

    The root of the largest sum of a row of the Jacobian's square: for an oscillator its pulsation. A state that is a
    share of the most that it may be settles there, if anywhere, and not where it begins.
    """
    lines = ["    if parts == 0:", "        for i in range(n - 1):", "            for most in (0.0, 1.0):"]
    given = "signals, values, dt, i, 0.0, 1"
    at = [f"{state.name} + most" if state.unit == "1" else state.name for state in states]
    lines.append(f"                base = rates({given}, {', '.join(at)})")
    every = range(len(states))
    for moved in every:
        nudged = ", ".join(f"{name} + 1e-6" if j == moved else name for j, name in enumerate(at))
        lines.append(f"                moved = rates({given}, {nudged})")
        lines += [f"                j{row}{moved} = (moved[{row}] - base[{row}]) / 1e-6" for row in every]
    for row in every:
        squared = [" + ".join(f"j{row}{m} * j{m}{column}" for m in every) for column in every]
        total = " + ".join(f"abs({entry})" for entry in squared)
        lines.append(f"                fastest = max(fastest, ({total}) ** 0.5)")
    return [*lines, "        return fastest"]


def _stepped(states: list[str]) -> list[str]:
    """Emit one step of Runge and Kutta; the equation is then called with the states in its middle."""
    given = "signals, values, dt, i"

    def rates(stage: str, share: str, step: str) -> str:
        moved = states if not step else [f"{name} + {step}[{j}]" for j, name in enumerate(states)]
        return f"{stage} = rates({given}, {share}, parts, {', '.join(moved)})"

    lines = [
        rates("k1", "part / parts", ""),
        rates("k2", "share", "0.5 * h * k1"),
        rates("k3", "share", "0.5 * h * k2"),
        rates("k4", "(part + 1) / parts", "h * k3"),
    ]
    for j, name in enumerate(states):
        slope = f"(k1[{j}] + 2.0 * k2[{j}] + 2.0 * k3[{j}] + k4[{j}]) / 6.0"
        lines.append(f"next_{name} = {name} + h * {slope}")
    # The equation sees the mean of the states before and after; those before are not needed any more.
    return [*lines, *[f"{name} = 0.5 * ({name} + next_{name})" for name in states]]
