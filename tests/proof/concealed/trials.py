"""Trials: what each one is (`draw`), and making it (`make`)."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from engine.hardware import Hardware
from engine.laboratory import QUIET, Laboratory
from engine.mcap_file import Format, write
from engine.ports import NONE
from proof.concealed import articles, campaign, effects, paths
from proof.concealed.bench import Bench, beyond, measure, scaled
from proof.concealed.physics import Effect
from proof.concealed.ranges import ARTICLE, LABORATORY, LEVELS, SILENT, Split
from proof.concealed.recording import record
from proof.concealed.strength import Strength

Kind = Literal["nothing", "within", "beyond", "concealed"]

_NULLS: tuple[Kind, ...] = ("within", "nothing", "beyond")
_NULL_SHARE = 0.25
_SEVERAL = (0.8, 0.93)  # one effect below the first share of trials, two below the second, else three
_TRIES = 4
_NOTHING = 0.05  # sigmas that numbers are off where nothing is

_EPOCH_FIRST, _EPOCH_LAST = 803_206_800, 1_700_000_000  # s: days of a test programme somewhere in these years
RUN_S = 900


@dataclass(frozen=True, slots=True)
class Spec:
    """One trial, fixed by its numbers: the same spec makes the same bytes."""

    split: Split
    seed: int
    index: int
    kind: Kind
    physics: tuple[str, ...] = ()  # in order of preference: those that this rig cannot show are passed over
    count: int = 0  # of them to conceal
    levels: tuple[float, ...] = ()  # one for each concealed


class UnreachableError(Exception):
    """On this rig, an effect stays below the weakest level, or known parameters absorb it."""


class Run(NamedTuple):
    """A recording to be made."""

    file: str
    path: int  # -1: calibration
    role: str
    repeat: int


def draw(split: Split, count: int, seed: int) -> list[Spec]:
    """Say what each of `count` trials is. More trials of the same seed begin with the same ones.

    Every physics comes once before any comes again.
    """
    order = np.random.default_rng([seed, len(split), 1])
    specs: list[Spec] = []
    deck: list[str] = []
    nulls = 0
    for index in range(count):
        rng = np.random.default_rng([seed, len(split), 2, index])
        u = rng.uniform(size=2)
        levels = tuple(float(level) for level in rng.permutation(LEVELS)[:3])
        if u[0] < _NULL_SHARE:
            specs.append(Spec(split, seed, index, _NULLS[nulls % 3]))
            nulls += 1
            continue
        if len(deck) < 8:
            deck += [effects.PHYSICS[k].name for k in order.permutation(len(effects.PHYSICS))]
        several = 1 + sum(u[1] > share for share in _SEVERAL)
        named = [deck.pop(0) for _ in range(several)]
        spare = [
            effects.PHYSICS[k].name
            for k in rng.permutation(len(effects.PHYSICS))
            if effects.PHYSICS[k].name not in named
        ]
        specs.append(Spec(split, seed, index, "concealed", (*named, *spare), several, levels[:several]))
    return specs


def chosen(split: Split, seed: int, index: int, physics: Sequence[str], level: float) -> Spec:
    """One trial with these physics, each at one level."""
    count = len(physics)
    return Spec(split, seed, index, "concealed", tuple(physics), count, (level,) * count)


def streams(spec: Spec) -> list[np.random.SeedSequence]:
    """Streams of random numbers: what is seen of a trial does not depend on what is concealed in it."""
    return np.random.SeedSequence([spec.seed, len(spec.split), 3, spec.index]).spawn(7)


def laboratory_of(split: Split, rng: np.random.Generator) -> Laboratory:
    """Draw how much acts at random in a trial."""
    silent = rng.uniform() < SILENT
    drawn = {name: drawn.draw(rng, split) for name, drawn in LABORATORY.items()}
    return QUIET if silent else Laboratory(**drawn)


def prepare(spec: Spec, folder: Path) -> tuple[Bench, list[dict[str, Any]]]:
    """Write the parameter files; draw hardware and trajectories; work out the metric."""
    article, drawn, motions, _, runs, off, chance = streams(spec)
    rates = describe_article(folder, np.random.default_rng(article), spec.split)
    nominal = Hardware.from_campaign(folder)
    hardware = hardware_of(spec.kind, nominal, np.random.default_rng(drawn))
    trajectories = paths.draw(np.random.default_rng(motions), spec.split, 3)
    calibration = paths.calibration(np.random.default_rng(runs.spawn(2)[1]))
    noise = np.random.default_rng(chance)
    laboratory = laboratory_of(spec.split, noise)
    if spec.kind in ("nothing", "within"):  # of nothing there is no strength
        return Bench(hardware, tuple(trajectories), calibration, rates, (), (), (), laboratory), []
    bench = measure(hardware, trajectories, rates, calibration, laboratory, noise)
    if spec.kind == "concealed":
        return bench, []
    hardware, moved = beyond(bench, nominal, np.random.default_rng(off), spec.split)
    return replace(bench, hardware=hardware), moved


def describe_article(folder: Path, rng: np.random.Generator, split: Split, loop: str = "") -> tuple[float, float]:
    """Write a drawn article's campaign, without recordings; return the rates of wrench and encoders, Hz.

    The loop is drawn, too, where none is given.
    """
    drawn = str(rng.choice(["open", "closed"]))
    articles.write(folder, rng, split, loop or drawn)
    wrench_hz, encoder_hz = articles.rates(rng, split)
    articles.set_corner(folder, round(wrench_hz * ARTICLE["transducer.corner"].draw(rng, split), 1))
    campaign.describe(folder, [])
    return wrench_hz, encoder_hz


def hardware_of(kind: Kind, nominal: Hardware, rng: np.random.Generator) -> Hardware:
    """Draw the hardware around its nominal numbers."""
    drawn = nominal.drawn(rng)
    if kind != "nothing":
        return drawn
    # Numbers that are just what the files say would tell the kind apart, beside all physics.
    near = {
        name: value
        if name == "transducer.bias" or ".drive.phi_" in name
        else nominal[name] + _NOTHING * (value - nominal[name])
        for name, value in drawn.values.items()
    }
    return nominal.with_values(near)


def conceal(bench: Bench, spec: Spec, rng: np.random.Generator) -> list[tuple[Effect, Strength, float]]:
    """Draw the effects and scale each, alone, to its level."""
    concealed: list[tuple[Effect, Strength, float]] = []
    swept = paths.swept(bench.fitted)
    for name in spec.physics:
        if len(concealed) == spec.count:
            break
        for _ in range(_TRIES if len(spec.physics) == 1 else 2):
            effect = effects.draw(effects.BY_NAME[name], rng, spec.split, swept)
            if any(effect.place == other.place and effect.physics.port == other.physics.port
                   for other, _, _ in concealed):  # fmt: skip
                continue
            found = scaled(bench, effect, spec.levels[len(concealed)])
            if found is not None:
                concealed.append(found)
                break
    if len(concealed) < spec.count:
        wanted = ", ".join(spec.physics[:3])
        raise UnreachableError(f"none of {wanted} can be concealed in this rig so that it can be seen")
    return concealed


def make(spec: Spec, folder: Path) -> dict[str, Any]:
    """Make a trial's campaign in `folder`, which may not exist yet; return its truth."""
    folder.mkdir(parents=True, exist_ok=True)
    bench, moved = prepare(spec, folder)
    *_, concealing, runs_, _, _ = streams(spec)
    concealed = conceal(bench, spec, np.random.default_rng(concealing)) if spec.count else []
    hidden = [effect for effect, _, _ in concealed]
    total = bench.strength(hidden).rho_eff if hidden else 0.0
    _record(spec, folder, bench, hidden, runs_)
    return {
        "trial": folder.name,
        "kind": spec.kind,
        "split": spec.split,
        "level": max((level for _, _, level in concealed), default=0.0),
        "effects": [told(effect, found) for effect, found, _ in concealed],
        "beyond": moved,
        "rho_eff": total,
        "laboratory": asdict(bench.laboratory),
    }


def name_of(spec: Spec) -> str:
    """A name that says nothing."""
    return np.random.default_rng([spec.seed, len(spec.split), 4, spec.index]).bytes(4).hex()


def make_named(spec: Spec, out: Path, truths: Path) -> dict[str, Any]:
    """Make a trial in `out` under a name that says nothing, and write its truth into another folder."""
    name = name_of(spec)
    made = make(spec, out / name)
    (truths / f"{name}.json").write_text(json.dumps(made, indent=1) + "\n")
    return made


def told(effect: Effect, found: Strength) -> dict[str, Any]:
    """What a truth says of one effect."""
    physics = effect.physics
    shapes = [
        {"name": shape.name, "unit": shape.unit, "value": value, "sigma_cr": None}
        for shape, value in zip(physics.shapes, effect.shapes, strict=True)
        if shape.name
    ]
    amplitude = {
        "name": "amplitude",
        "unit": physics.unit,
        "value": effect.amplitude,
        "sigma_cr": effect.amplitude / found.rho_eff if physics.comparable else None,
    }
    return {
        "name": physics.name,
        "port": physics.port,
        "axis": effect.axis,
        "channels": list(effect.channels),
        "family": physics.family,
        "catalogued": physics.catalogued,
        "rho": found.rho,
        "kappa": found.kappa,
        "rho_eff": found.rho_eff,
        "parameters": [amplitude, *shapes],
        "equivalents": None,
    }


def _record(spec: Spec, folder: Path, bench: Bench, hidden: Sequence[Effect], seed: np.random.SeedSequence) -> None:
    """Record all runs and describe the campaign."""
    names, starts, *streams = seed.spawn(10)
    runs = named(np.random.default_rng(names), planned(len(bench.trajectories)))
    start = first_second(np.random.default_rng(starts))
    (folder / "recordings").mkdir(exist_ok=True)
    checked: list[dict[str, Any]] = []
    for k, run in enumerate(runs):
        path = bench.calibration if run.path < 0 else bench.trajectories[run.path]
        assert path is not None
        recording = record(
            bench.hardware,
            path,
            bench.extra(hidden, float(path.t[-1])) if hidden else NONE,
            seed=streams[k],
            epoch_ns=(start + k * RUN_S) * 1_000_000_000,
            wrench_hz=bench.rates[0],
            encoder_hz=bench.rates[1],
            laboratory=bench.laboratory,
        )
        write(folder / "recordings" / run.file, recording, Format(message_index=False))
        checked.append(entry(folder, run))
    campaign.describe(folder, checked)


def first_second(rng: np.random.Generator) -> int:
    """Draw when a campaign starts, s since 1970."""
    return int(rng.integers(_EPOCH_FIRST, _EPOCH_LAST))


def entry(folder: Path, run: Run) -> dict[str, Any]:
    """What the campaign's description says of a recording that was written."""
    file = f"recordings/{run.file}"
    digest = hashlib.sha256((folder / file).read_bytes()).hexdigest()
    trajectory = "CALIBRATION" if run.path < 0 else f"TRACK{run.path + 1}"
    return {"file": file, "sha256": digest, "trajectory": trajectory, "role": run.role, "repeat": run.repeat}


def planned(trajectories: int) -> list[tuple[int, str, int]]:
    """Calibration, two runs of each trajectory for fitting, one more of the first and one of the last held out."""
    runs = [(-1, "calibration", 1)]
    runs += [(path, "fit", repeat) for path in range(trajectories - 1) for repeat in (1, 2)]
    return [*runs, (0, "held-out", 3), (trajectories - 1, "held-out", 1)]


def named(rng: np.random.Generator, runs: Sequence[tuple[int, str, int]]) -> list[Run]:
    """Give the recordings of these runs (path, role, repeat) names that say nothing."""
    return [Run(f"{rng.bytes(4).hex()}.mcap", *run) for run in runs]
