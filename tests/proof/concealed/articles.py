"""Nominal articles of other sizes, as parameter files: campaigns/EL089's structure with numbers of their own."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from engine.campaigns import CAMPAIGNS_FOLDER
from engine.hardware import AXES
from proof.concealed.ranges import ARTICLE, Split

PATTERN = CAMPAIGNS_FOLDER / "EL089" / "parameters"
FILES = ("parameters/rig.toml", "parameters/drives.toml")

Tree = dict[str, Any]


def write(folder: Path, rng: np.random.Generator, split: Split, loop: str) -> None:
    """Draw an article's nominals and write its parameter files."""

    def factor(name: str) -> float:
        return ARTICLE[name].draw(rng, split)

    rig, drives = (tomllib.loads((PATTERN / Path(file).name).read_text()) for file in FILES)
    _transducer(rig["transducer"], rng, factor)
    _bodies(rig, rng, factor)
    bits = int(factor("encoder.bits"))
    for axis in AXES:
        rig["joint"][axis]["encoder"]["step"] |= {"value": 2 * np.pi / 2**bits, "source": f"{bits} bits"}
    drives["controller"]["loop"] = loop
    for axis in AXES:
        drive = drives["joint"][axis]["drive"]
        drive["ratio"]["value"] = factor("drive.ratio")
        _scale(drive["rotor_inertia"], factor("drive.rotor_inertia"))
        for name, leaf in drive["parameters"].items():
            if f"drive.{name}" in ARTICLE:
                _scale(leaf, factor(f"drive.{name}"))
    (folder / "parameters").mkdir(parents=True, exist_ok=True)
    for file, tree in zip(FILES, (rig, drives), strict=True):
        heading = f"#:schema ../../../schemas/parameters.schema.json\n{_toml(tree)}"
        (folder / file).write_text(heading)


def rates(rng: np.random.Generator, split: Split) -> tuple[float, float]:
    """Sampling rates of the transducer and of the encoders, Hz."""
    return ARTICLE["transducer.rate"].draw(rng, split), ARTICLE["encoder.rate"].draw(rng, split)


def set_corner(folder: Path, corner: float) -> None:
    """Write the amplifier's corner (Hz), which goes with the sampling rate."""

    def change(transducer: Tree) -> None:
        transducer["amplifier"]["corner"] |= {"value": corner, "sigma": round(0.01 * corner, 4)}

    _rewrite(folder, change)


def scale_noise(folder: Path, factor: float) -> None:
    """Write another noise of the transducer: at another sampling rate, the same density is another number."""
    _rewrite(folder, lambda transducer: _scale(transducer["noise"], factor))


def _rewrite(folder: Path, change: Callable[[Tree], None]) -> None:
    """Change the transducer in the file that describes it."""
    file = folder / FILES[0]
    tree = tomllib.loads(file.read_text())
    change(tree["transducer"])
    file.write_text(f"#:schema ../../../schemas/parameters.schema.json\n{_toml(tree)}")


def _transducer(transducer: Tree, rng: np.random.Generator, factor: Any) -> None:
    _scale(transducer["stiffness"], factor("transducer.stiffness"))
    _scale(transducer["damping"], factor("transducer.damping"))
    _scale(transducer["noise"], factor("transducer.noise"))
    step = factor("transducer.resolution")
    transducer["resolution"]["value"] = [step * v for v in transducer["resolution"]["value"]]
    coupling = transducer["cross_coupling"]
    spread = np.array(coupling["sigma"])
    drawn = np.asarray(coupling["value"]) + 4 * spread * rng.standard_normal((6, 6)) * (1 - np.eye(6))
    coupling["value"] = np.round(drawn, 6).tolist()


def _bodies(rig: Tree, rng: np.random.Generator, factor: Any) -> None:
    size = factor("body.antenna.size")
    for name in ("base", "azimuth", "antenna"):
        body = rig["body"][name]
        mass = factor(f"body.{name}.mass")
        _scale(body["mass"], mass)
        body["mass"]["sigma"] = 0.05
        inertia = mass * (size**2 if name == "antenna" else 1.0)
        _scale(body["inertia"], inertia)
    antenna = rig["body"]["antenna"]["cog"]
    signs = rng.choice([-1.0, 1.0], 3)
    antenna["value"] = [round(float(s * size * v), 4) for s, v in zip(signs, antenna["value"], strict=True)]


def _scale(leaf: Tree, factor: float) -> None:
    for key in ("value", "sigma"):
        leaf[key] = _rounded(leaf[key], factor)


def _rounded(value: Any, factor: float) -> Any:
    if isinstance(value, list):
        return [_rounded(v, factor) for v in value]
    return float(f"{value * factor:.4g}")


def _toml(tree: Mapping[str, Any], path: tuple[str, ...] = ()) -> str:
    """Tables nested, quantities inline."""
    lines: list[str] = []
    plain = {k: v for k, v in tree.items() if not isinstance(v, dict) or _inline(v)}
    if path and plain:
        lines.append(f"\n[{'.'.join(path)}]")
    lines += [f"{key} = {_value(value)}" for key, value in plain.items()]
    text = "\n".join(lines) + "\n" if lines else ""
    for key, value in tree.items():
        if key not in plain:
            text += _toml(value, (*path, key))
    return text


def _inline(table: Mapping[str, Any]) -> bool:
    return "value" in table or "step" in table or "corner" in table


def _value(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_value(v)}" for key, v in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(_value(v) for v in value) + "]"
    if isinstance(value, str):
        return f'"{value}"'
    return repr(value)
