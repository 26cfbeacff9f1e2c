"""Files of two loggers from which a campaign is begun: what is written can be read, and nothing is warned of."""

from __future__ import annotations

import random
import tomllib
import warnings
from pathlib import Path

import numpy as np

from kbs_process.studies.convert.begin import begin
from mutations.subject import Subject, Tell, damaged
from mutations.tables import CELLS

_FILES = ("wrench.csv", "angle.csv")
_LATE = 1.25  # s


def _make(folder: Path) -> None:
    rng, t = np.random.default_rng(7), np.round(0.02 * np.arange(1000), 6)
    angle = 0.6 - 0.6 * np.cos(0.2 * (t + _LATE) ** 1.2)
    loads = np.stack([5.0 * np.sin(angle), 0.0 * t, -50.0 + 0.0 * t, 0.0 * t, 6.0 * np.cos(angle), 0.0 * t], axis=1)
    columns = np.column_stack([t, loads + 0.01 * rng.standard_normal(loads.shape)])
    header = "time (s),Fx (N),Fy (N),Fz (N),Mx (Nm),My (Nm),Mz (Nm)"
    np.savetxt(folder / _FILES[0], columns, "%.5f", ",", header=header, comments="")
    degrees = np.degrees(0.6 - 0.6 * np.cos(0.2 * t**1.2))
    np.savetxt(folder / _FILES[1], np.column_stack([t, degrees]), "%.5f", ",", header="time (s),arm (deg)", comments="")


def _mutate(rng: random.Random, folder: Path) -> str:
    path = folder / rng.choice(_FILES)
    if rng.random() < 0.5:
        lines = [line.split(",") for line in path.read_text(encoding="utf-8").splitlines()]
        row, cell = rng.randrange(len(lines)), rng.choice(CELLS)
        column = rng.randrange(len(lines[row]))
        lines[row][column] = cell
        path.write_text("\n".join(",".join(line) for line in lines) + "\n", encoding="utf-8")
        return f"{path.name}: cell {column} of line {row} is {cell[:20]!r}"
    changed, what = damaged(rng, path.read_bytes())
    path.write_bytes(changed)
    return f"{path.name}: {what}"


def _judge(folder: Path, tell: Tell) -> None:
    warnings.simplefilter("error")
    list(begin(folder / "begun", [folder / name for name in _FILES]))
    mapping = tomllib.loads((folder / "begun" / "mapping.toml").read_text(encoding="utf-8"))
    for name in ("campaign", "rig"):
        tomllib.loads((folder / "begun" / f"{name}.toml").read_text(encoding="utf-8"))
    shift = mapping["recording"][0].get("shift_s", {}).get("wrench", "?")
    known = mapping["recording"][0].get("shift_sigma_s", 0.0)
    asked = shift == "?" or "text" in mapping  # a question, or a table that begins elsewhere
    tell("reported" if asked else "right" if abs(shift - _LATE) < 0.01 + 5.0 * known else "wrong")


SUBJECTS = (Subject("init", 1.0, _make, _mutate, _judge),)
