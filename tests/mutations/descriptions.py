"""Campaign and parameter files with careless values, and results on disk that were damaged."""

from __future__ import annotations

import copy
import json
import random
import tomllib
import zlib
from collections.abc import Iterator, Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from end_to_end.short_campaign import short_campaign
from kbs_process import cli
from kbs_process.campaign.load import load_campaign
from kbs_process.campaign.writing.parameter_files import text_of
from kbs_process.results.store import LIST
from mutations.subject import Subject, Tell, damaged

_FILES = ("campaign.toml", "parameters/rig.toml", "parameters/drives.toml")
_PROCESSED = 80  # one in so many of those that load is processed, too
_HERE = "the value goes here"
_VALUES = (
    "0", "-1", "1", "1.0", "3", "-0.0", "1e-9", "1e9", "1e308", "-1e308", "5e-324", "nan", "inf", "9" * 400, "true",
    '""', '"x"', '"nan"', '"../x"', '"\\u0000"', '"\\u001b[2J"', "[]", "[0]", "[0, 0, 0]", "[[1, 2], [3]]", "{}",
    "{ value = 1.0 }", "1979-05-27", "[nan, 0, 0]", "[1e9, 1e9, 1e9]", "[0, 0, 0, 0, 0, 0]",
)  # fmt: skip
_FACTORS = (10.0, 0.1, -1.0, 1e6, 1e-6)
Key = tuple[str | int, ...]


def _make(folder: Path) -> None:
    short_campaign(folder / "EL089")
    rig = load_campaign(folder / "EL089", checksums=False).rig
    known = {name: quantity.value.tolist() for name, quantity in rig.quantities().items()}
    (folder / "known.json").write_text(json.dumps({"raw": _raw(folder / "EL089"), "si": known}))


def _raw(campaign: Path) -> dict[str, list[Any]]:
    """Value and unit of every number in the parameter files, by its dotted name."""
    found = {}
    for file in _FILES[1:]:
        tree = tomllib.loads((campaign / file).read_text(encoding="utf-8"))
        for key in _keys(tree):
            table = _at(tree, key)
            if isinstance(table, dict) and {"value", "unit"} <= set(table):
                found[".".join(str(part) for part in key if part != "parameters")] = [table["value"], table["unit"]]
    return found


def _keys(node: Any, key: Key = ()) -> Iterator[Key]:
    children = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for name, child in children:
        yield (*key, name)
        yield from _keys(child, (*key, name))


def _at(tree: Any, key: Key) -> Any:
    for part in key:
        tree = tree[part]
    return tree


def _mutate(rng: random.Random, folder: Path) -> str:
    file = rng.choice(_FILES)
    path = folder / "EL089" / file
    text = path.read_text(encoding="utf-8")
    if rng.random() < 0.15:
        changed, what = damaged(rng, text.encode())
        path.write_bytes(changed)
        return f"{file}: {what}"
    tree = tomllib.loads(text)
    key = rng.choice(list(_keys(tree)))
    given = _at(tree, key)
    value = rng.choice(_VALUES)
    if isinstance(given, int | float) and rng.random() < 0.5:
        value = repr(rng.choice(_FACTORS) * given)
    changed_tree = copy.deepcopy(tree)
    _at(changed_tree, key[:-1])[key[-1]] = _HERE
    path.write_text(text_of(changed_tree).replace(f'"{_HERE}"', value), encoding="utf-8")
    return f"{file}: {'.'.join(map(str, key))} = {value[:30]}"


def _judge(folder: Path, tell: Tell) -> None:
    campaign = folder / "EL089"
    loaded = load_campaign(campaign, checksums=False)
    known, raw = json.loads((folder / "known.json").read_text()), _raw(campaign)
    for name, quantity in loaded.rig.quantities().items():
        if name not in known["si"] or name not in known["raw"] or name not in raw:
            continue
        if not _follows(quantity.value, np.array(known["si"][name]), known["raw"][name], raw[name]):
            tell("wrong")
            return
    tell("right")
    if zlib.crc32((campaign / "campaign.toml").read_bytes() + (campaign / _FILES[1]).read_bytes()) % _PROCESSED == 0:
        _run(tell, str(campaign), "--no-diagnose", "--quiet", "--output", str(folder / "results"))


def _follows(value: np.ndarray, before: np.ndarray, given_before: Sequence[Any], given: Sequence[Any]) -> bool:
    """Whether a number in SI changed as the one that is given did, where its unit is the same."""
    if given[1] != given_before[1]:
        return True
    try:
        old, new = (np.asarray(one, dtype=np.float64) for one in (given_before[0], given[0]))
    except (ValueError, TypeError, OverflowError):
        return True
    if old.shape != new.shape or old.shape != before.shape:
        return True
    scaled = np.divide(before * new, old, out=np.where(new == 0.0, 0.0, value), where=old != 0.0)
    return np.allclose(value, scaled, rtol=1e-12, atol=1e-307)  # below it doubles lose their digits


def _run(tell: Tell, *arguments: str) -> None:
    """Run a command, which may end with 0, 1 or 2."""
    try:
        cli.main(arguments)
    except SystemExit as ended:
        code = ended.code or 0
        tell("refused" if code == 2 else "right" if code in (0, 1) else "fault")
        return
    tell("right")


def _make_results(folder: Path) -> None:
    campaign = short_campaign(folder / "EL089")
    try:
        cli.main([str(campaign.path), "--no-diagnose", "--quiet", "--output", str(folder / "results")])
    except SystemExit as ended:
        assert not ended.code, "the sound campaign is processed"


def _mutate_results(rng: random.Random, folder: Path) -> str:
    results = folder / "results"
    told = _damage_results(rng, results)
    names = (line.partition("  ")[2] for line in (results / LIST).read_text(encoding="utf-8").splitlines())
    # As if the program had written it so; it refuses to replace what was changed since.
    lines = [f"{sha256((results / name).read_bytes()).hexdigest()}  {name}\n" for name in names]
    (results / LIST).write_text("".join(lines), encoding="utf-8")
    return told


def _damage_results(rng: random.Random, results: Path) -> str:
    path = results / "results.json"
    if rng.random() < 0.3:
        path = rng.choice([path, *sorted(results.rglob("*.parquet"))])
        changed, what = damaged(rng, path.read_bytes())
        path.write_bytes(changed)
        return f"{path.name}: {what}"
    tree = json.loads(path.read_text(encoding="utf-8"))
    key = rng.choice(list(_keys(tree)))
    value = rng.choice((None, 0, -1, 1e308, 10**400, "", "x", "\x1b[2J", [], {}, True, [[]], "<script>", {"a": {}}))
    if rng.random() < 0.2:
        parent = _at(tree, key[:-1])
        del parent[key[-1]]
        value = "gone"
    else:
        _at(tree, key[:-1])[key[-1]] = value
    path.write_text(json.dumps(tree), encoding="utf-8")
    return f"{'.'.join(map(str, key))} = {str(value)[:20]!r}"


def _judge_results(folder: Path, tell: Tell) -> None:
    _run(tell, "report", str(folder / "results"))


SUBJECTS = (
    Subject("toml", 6.0, _make, _mutate, _judge),
    Subject("results", 0.25, _make_results, _mutate_results, _judge_results),
)
