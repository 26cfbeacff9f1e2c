"""The catalogue of all laws as a page, from what they declare."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from importlib import import_module
from types import ModuleType

from kbs_process.plant.effect import Law, LogNormal, Normal, Parameter, Port
from kbs_process.plant.laws import laws_of, modules
from kbs_process.plant.sensing import SensingPort

_BEGINNING = """# Catalogue of effects

What a prediction may lack, and what the diagnosis tries when recordings differ from it. This page is written from the
laws by `python -m kbs_process.plant.laws > docs/catalogue.md`. Each law is declared in the file that its section names,
in `pipeline/kbs_process/plant/laws/`.

A campaign's model names some laws of the plant. The others are its suspects. Put any of them into a model by naming it
under `[model] effects` and giving its parameters. A second action of the same law at the same joint is called `NAME_2`,
with parameters `PARAMETER_2`. Laws of sensors and clocks that are the same in every recording go under
`[model] sensing`. What drifts, hums or drops samples has numbers of its own in each recording.

## How a suspect is tried

A law is linear in its *amplitudes*, without which it is absent. Its *shapes* are searched on a grid. Along the motion
that the plant has without it, the law's own equation gives the input that a unit of each amplitude would have been.
Inputs are means over 10 ms, so what is faster averages out and does not alias. States are integrated along. Sent
through the linearised plant, the input gives the law's signature.

The signature is right to first order. It is not where a little of the law already changes the plant's own stiffness or
damping: friction that sticks, a dead zone, stick-slip. There the signature still finds the port (the encoder shows it
rightly), and the law is judged inside the plant.

A force on a link acts at the CoG of the link's bodies. One that may act anywhere is also tried on the faces of the
homogeneous box that has the link's mass and inertia. The fit in the plant then finds the point (`point_x`, `point_y`,
`point_z`, m in the link's axes). What has a place along a joint is looked for on a coarse grid and where the residual
is greatest, and its place and width are fitted. A slope of each recording is taken out before, so a linear drift is
absorbed.

Measured laws have no name: a torque over an angle or a rate that no other law fits. What a diagnosis measures of it is
a table, and the corrected model contains it as one of them. A search tries the same splines as curves.

## What is no suspect

Masses, centres of gravity and inertias, inclination, misalignment, stiffness and damping of the transducer, encoder
offsets, gains of the controller, and whatever else the parameter files give with a sigma. They are refitted, and called
"parameters off" when that is all there is. Gyroscopic and Coriolis terms are part of the rigid bodies and cannot be
left out.

## Where physics acts decides what shows

| port | what acts there | in a diagnosis | what shows |
| --- | --- | --- | --- |
"""

_READING = """
## How to read the laws

`N(m, s)` is a normal prior with mean m and standard deviation s. `LN(m, s)` is the prior of a positive number whose
logarithm is normal, with median m. `U(a, b)` is uniform. A grid over a signal has shares of the range that the signal
sweeps. Symbols: rotor angle and rate $\\theta_r$, $\\omega_r$; joint angle and rate $\\theta_l$, $\\omega_l$; field
$\\theta_f$; ratio $R$.
"""


def catalogue() -> str:
    """Return the page."""
    ports = (f"| {port.title} | {port.what} | {port.word} | {port.shows} |\n" for port in (*Port, *SensingPort))
    return "".join([_BEGINNING, *ports, _READING, *_laws()])


def _laws() -> Iterator[str]:
    folder = ""
    for module in modules():
        if not (laws := laws_of(module)):
            continue
        above, _, file = module.__name__.rpartition(".")
        if above != folder:
            folder = above
            yield f"\n## {_last(folder).capitalize()}\n\n{_first(import_module(folder))}\n"
        yield f"\n### {_last(folder)}/{file}.py\n\n{_first(module)}\n"
        for law in laws:
            yield from _law(law)


def _law(law: Law) -> Iterator[str]:
    sides = [f"At: {law.port.title}"]
    sides += [f"family: {law.family}"] if law.family else []
    sides += ["its size is each recording's own"] if law.each_trial else []
    sides += [] if law.suspected else ["never a suspect"]
    yield f"\n#### `{law.name}`\n\n{'; '.join(sides)}.\n\n"
    yield f"{inspect.cleandoc(law.equation.__doc__ or '').partition(chr(10) * 2)[0]}\n\n"
    yield from (f"- {heading}: {law.section(heading)}\n" for heading in ("Equation", "Units", "Validity", "Source"))
    yield "\n| parameter | unit | meaning | prior | bounds | search |\n| --- | --- | --- | --- | --- | --- |\n"
    yield from map(_parameter, law.parameters)


def _parameter(entry: Parameter) -> str:
    low, high = entry.bounds
    cells = (
        f"`{entry.name}`", entry.unit, entry.description, _prior(entry), f"{low:.6g} to {high:.6g}", _search(entry),
    )  # fmt: skip
    return f"| {' | '.join(cells)} |\n"


def _prior(entry: Parameter) -> str:
    match entry.prior:
        case Normal(mean, sigma):
            return f"N({mean:g}, {sigma:g})"
        case LogNormal(median, sigma):
            return f"LN({median:g}, {sigma:g})"
        case uniform:
            return f"U({uniform.low:.3g}, {uniform.high:.3g})"


def _search(entry: Parameter) -> str:
    if entry.role != "shape":
        return "amplitude" if entry.role == "amplitude" else "another law's"
    tried = ", ".join(f"{value:.3g}" for value in entry.grid)
    if len(entry.grid) > 8:
        tried = f"{len(entry.grid)} values from {min(entry.grid):.3g} to {max(entry.grid):.3g}"
    parts = [f"{tried} over {entry.over}" if entry.over else tried] if tried else []
    parts += [f"{entry.proposed} that the residual shows"] if entry.proposed else []
    return "; ".join(parts) or "none"


def _first(module: ModuleType) -> str:
    return inspect.cleandoc(module.__doc__ or "").partition("\n\n")[0]


def _last(name: str) -> str:
    return name.rpartition(".")[2]
