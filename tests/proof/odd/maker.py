"""Making a case: a trial of `proof.concealed`, but for what is odd."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from engine.hardware import Hardware
from engine.mcap_file import Format, write
from engine.ports import Extra
from engine.sensors import Recording
from engine.simulation import TIME_STEP
from engine.trajectories import Commands
from proof.concealed import articles, campaign, effects, trials
from proof.concealed.physics import Effect
from proof.concealed.ranges import STAMP_JITTER, Split
from proof.concealed.recording import record
from proof.concealed.sensing import CHANNELS
from proof.concealed.sensitivity import perturbed
from proof.concealed.strength import Strength
from proof.odd import aslant, latch, motions, without_encoder
from proof.odd.cases import Case, Concealed

_SPLIT: Split = "development"
_LONG_S = 1000.0  # a longer run is read half as often, and its steps are longer: it would take an hour else
_LONG_STEP = 2.5e-4  # s
_MANY = 100_000  # messages of a topic: zstd at its highest level would take minutes
_CLIPPED = CHANNELS.index("Tz")
_OWN = latch, aslant  # laws of these campaigns alone
PHYSICS = effects.BY_NAME | {own.PHYSICS.name: own.PHYSICS for own in _OWN}


def make(case: Case, folder: Path) -> dict[str, Any]:
    """Make a case's campaign in `folder`; return its truth. The same case makes the same bytes."""
    (folder / "recordings").mkdir(parents=True, exist_ok=True)
    article, drawn, drawing, calibrating, names, day, runs = (
        np.random.SeedSequence([case.seed, 7, 3]).spawn(7)
    )  # fmt: skip
    rates = trials.describe_article(folder, np.random.default_rng(article), _SPLIT, case.loop)
    if case.noise != 1.0:
        articles.scale_noise(folder, case.noise)
    hardware = _hardware(case, folder, np.random.default_rng(drawn))
    paths = motions.driven(case, _SPLIT, np.random.default_rng(drawing), np.random.default_rng(calibrating))
    named = trials.named(np.random.default_rng(names), case.runs or trials.planned(case.trajectories))
    start = trials.first_second(np.random.default_rng(day))
    if case.rate_hz:
        rates = case.rate_hz, case.rate_hz
    entries: list[dict[str, Any]] = []
    for run, seed in zip(named, runs.spawn(len(named)), strict=True):
        path = paths[run.path]
        recording = _recorded(case, hardware, path, rates, seed, start)
        if case.bounds and run.path >= 0:
            reading = recording.wrench.values[:, _CLIPPED]
            np.minimum(reading, case.bounds[run.path], out=reading)
        _write(case, folder / "recordings" / run.file, recording)
        entries.append(trials.entry(folder, run))
        start += max(trials.RUN_S, int(path.t[-1]) + 600)
    campaign.describe(folder, entries)
    if case.encoder != "recorded":
        without_encoder.describe(folder, command_in_its_place=case.encoder == "command in its place")
    return truth(case)


def make_named(case: Case, out: Path, truths: Path) -> None:
    """Make a case in `out` under its name, and write its truth into another folder."""
    made = make(case, out / case.name)
    (truths / f"{case.name}.json").write_text(json.dumps(made, indent=1) + "\n")


def truth(case: Case) -> dict[str, Any]:
    """What a trial's truth says, and which answers are right and wrong."""
    together = case.rho_eff or sum(one.rho_eff for one in case.effects)
    return {
        "trial": case.name,
        "kind": "concealed" if case.effects else "beyond" if case.moved else "within",
        "split": _SPLIT,
        "effects": [trials.told(effect(one), Strength(one.rho, one.kappa, one.rho_eff)) for one in case.effects],
        "beyond": [{"name": f"{one.name}[{one.element}]", "sigmas": one.sigmas} for one in case.moved],
        "rho_eff": together,
        "case": f"{case.number}: {case.title}",
        "done": case.done,
        "right": case.right,
        "wrong": case.wrong,
    }


def _hardware(case: Case, folder: Path, rng: np.random.Generator) -> Hardware:
    nominal = Hardware.from_campaign(folder)
    hardware = trials.hardware_of("nothing" if case.moved else "within", nominal, rng)
    for one in case.moved:
        sigma = float(np.ravel(nominal.sigmas[one.name])[one.element])
        hardware = perturbed(hardware, (one.name, one.element), one.sigmas * sigma)
    return hardware


def effect(one: Concealed) -> Effect:
    """The physics that the table names, with its numbers there."""
    return Effect(PHYSICS[one.physics], one.place, one.shapes, one.amplitude)


def _extra(case: Case, hardware: Hardware, duration: float) -> Extra:
    hidden = tuple(effect(one) for one in case.effects)
    for own in _OWN:
        if any(one.physics is own.PHYSICS for one in hidden):
            return own.extra(*hidden)  # alone: the engine lets one law act that is not in its table
    return effects.extra(hidden, hardware, np.zeros((len(CHANNELS), 2)), duration)


def _recorded(
    case: Case, hardware: Hardware, path: Commands, rates: tuple[float, float],
    seed: np.random.SeedSequence, start: int,
) -> Recording:  # fmt: skip
    duration = float(path.t[-1])
    long = duration > _LONG_S
    return record(
        hardware,
        path,
        _extra(case, hardware, duration),
        seed=seed,
        epoch_ns=start * 1_000_000_000,
        wrench_hz=rates[0] / 2 if long else rates[0],
        encoder_hz=rates[1] / 2 if long else rates[1],
        stamp_jitter=STAMP_JITTER if case.stamp_jitter is None else case.stamp_jitter,
        time_step=_LONG_STEP if long else TIME_STEP,
    )


def _write(case: Case, file: Path, recording: Recording) -> None:
    many = len(recording.wrench.stamp) > _MANY
    write(file, recording, Format(compression="lz4" if many else "zstd", message_index=False))
    if case.encoder != "recorded":
        without_encoder.drop_messages(file)
