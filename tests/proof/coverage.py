"""Do intervals of known numbers hold the truth? Of development trials, whose hardware their seed draws again.

    python -m proof.coverage --seed S --count N [--first K] [--null KIND] RESULTS...

Trials are those that `python -m proof.concealed --set dev` makes with the same options; RESULTS are folders with a
diagnosis of each, by its name. Numbers count that recordings tell: known to less than `TOLD` of what their files say
they are known to. A number that differs from run to run, as friction does, is meant at its mean.
"""

from __future__ import annotations

import argparse
import json
import re
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from engine.hardware import Hardware
from proof.answer import Moved
from proof.concealed import trials
from proof.concealed.trials import Spec

TOLD = 0.5
_EXACT = 1e-9  # by which a file's number and the engine's reading of it may differ
_ELEMENT = re.compile(r"\[(\d+)\]")


@dataclass(frozen=True, slots=True)
class Number:
    """A known number after a refit: how far its value is from the truth, and what it is known to, in prior sigmas."""

    name: str
    error: float
    sigma: float

    @property
    def covered(self) -> bool:
        return abs(self.error) <= 1.96 * self.sigma

    @property
    def told(self) -> bool:
        return self.sigma < TOLD


def hardware(spec: Spec) -> tuple[Hardware, Hardware]:
    """Nominal numbers of a trial and those that it was recorded with; not of trials beyond their uncertainties."""
    if spec.kind == "beyond":
        raise ValueError("what is moved beyond its uncertainty is drawn with the motion, and not again here")
    article, drawn, *_ = trials.streams(spec)
    with tempfile.TemporaryDirectory() as folder:
        trials.describe_article(Path(folder), np.random.default_rng(article), spec.split)
        nominal = Hardware.from_campaign(Path(folder))
    return nominal, trials.hardware_of(spec.kind, nominal, np.random.default_rng(drawn))


def numbers(moved: Sequence[Mapping[str, Any]], nominal: Hardware, true: Hardware) -> Iterator[Number]:
    """Refitted numbers, as results tell them, beside the truth; phases, which have no prior, are left out."""
    for entry in moved:
        prior, spread = entry["prior"], entry["prior_sigma"]
        if prior is None or spread is None or not spread > 0.0 or not _has(nominal, entry["name"]):
            continue
        (given,) = _elements(entry["name"], nominal.values)
        if abs(given - prior) > _EXACT * max(abs(prior), spread):
            raise ValueError(f"{entry['name']} is {prior} in the results, and {given} in the trial of that name")
        (value,) = _elements(entry["name"], true.values)
        yield Number(entry["name"], (entry["value"] - value) / spread, entry["sigma"] / spread)


def answered(refitted: Sequence[Moved], nominal: Hardware, true: Hardware) -> Iterator[Number]:
    """The same of an answer's numbers; those of an effect that it found are none of the rig's."""
    for one in refitted:
        if not _has(nominal, one.name):
            continue
        value, spread = _elements(one.name, true.values, nominal.sigmas)
        yield Number(one.name, (one.value - value) / spread, one.sigma / spread)


def _elements(name: str, *of: Mapping[str, Any]) -> tuple[float, ...]:
    """What each has under the name that results give to a number."""
    key, at = _key(name, of[0]), tuple(map(int, _ELEMENT.findall(name)))
    return tuple(float(np.asarray(one[key], dtype=float)[at]) for one in of)


def _has(hardware: Hardware, name: str) -> bool:
    return _key(name, hardware.values) in hardware.values


def _key(name: str, of: Mapping[str, Any]) -> str:
    """What hardware calls a number of results."""
    plain = re.sub(r"(\.drive)\.", r"\1.parameters.", _ELEMENT.sub("", name))
    return plain if plain in of else plain.replace(".parameters", "")


def main(arguments: Sequence[str] | None = None) -> None:
    """Print, for each trial and for all, how many intervals of 95 % hold the truth."""
    parser = argparse.ArgumentParser(prog="python -m proof.coverage", description=__doc__)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--count", type=int, required=True)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--null", choices=("nothing", "within"))
    parser.add_argument("results", type=Path, nargs="+")
    asked = parser.parse_args(arguments)
    last = asked.first + asked.count
    specs = [Spec("development", asked.seed, k, asked.null) for k in range(last)] if asked.null else None
    specs = (specs or trials.draw("development", last, asked.seed))[asked.first :]
    held: list[bool] = []
    for spec in specs:
        name = trials.name_of(spec)
        paths = [path for path in (one / name / "results.json" for one in asked.results) if path.is_file()]
        if spec.kind == "beyond" or not paths:
            continue
        results = json.loads(paths[-1].read_text())
        told = [one for one in numbers(results["moved"], *hardware(spec)) if one.told]
        held += [one.covered for one in told]
        outside = sorted((one for one in told if not one.covered), key=lambda one: -abs(one.error) / one.sigma)
        worst = ", ".join(f"{one.name} {one.error / one.sigma:+.1f}" for one in outside[:3])
        print(f"{name} {results['answer']}: {len(told) - len(outside)} of {len(told)}  {worst}")
    if not held:
        raise SystemExit("none of these results is of such a trial")
    print(f"all: {sum(held)} of {len(held)}, {100.0 * sum(held) / len(held):.0f} %")


if __name__ == "__main__":
    main()
