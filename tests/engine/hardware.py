"""The hardware as plain numbers: read from a campaign's parameter files, or drawn around them.

Dotted names follow the parameter files without the word "parameters": `transducer.stiffness`,
`body.antenna.cog`, `joint.el.origin`, `joint.el.drive.Ka`, `joint.az.encoder.step`, `controller.Kp`.
Everything is SI.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

AXES = ("az", "el")
BODIES = ("base", "azimuth", "antenna")

# Factor to SI of every unit that the archive's parameter files use; another one is a KeyError.
_SI = {"mrad": 1e-3, "deg": np.pi / 180, "deg/s^2": np.pi / 180, "mm": 1e-3} | dict.fromkeys(
    (
        "1", "rad", "m", "s", "kg", "N", "N m", "Hz", "1/s", "m/s^2", "rad/s", "kg m^2", "N m/rad", "N/m",
        "N m s/rad", "SI by channel pair",
    ),
    1.0,
)  # fmt: skip

# What no campaign would call hardware: nothing is drawn for these.
_NOT_DRAWN = ("gravity.", "spacecraft.", "controller.", "transducer.noise", "transducer.resolution")
_TRUNCATION = 2.0  # sigmas; hardware further off than that would have been sent back


@dataclass(frozen=True, slots=True, eq=False)
class Bungee:
    """An elastic cord from an anchor in the laboratory to the antenna (configurations 3 and 4).

    Tension = stiffness * max(length - free_length, 0), along the cord.
    """

    anchor: tuple[float, float, float]  # m, in undeflected T
    stiffness: float  # N/m
    free_length: float  # m
    hook: tuple[float, float, float] | None = None  # m, in the antenna's axes; None: at its CoG

    def as_dict(self) -> dict[str, Any]:
        """Its numbers by name."""
        return {name: value for name, value in asdict(self).items() if value is not None}


@dataclass(frozen=True, slots=True, eq=False)
class Hardware:
    """One set of hardware: every number of the parameter files, in SI, by dotted name."""

    values: Mapping[str, Array]
    sigmas: Mapping[str, Array]
    loop: str = "open"  # "open" or "closed"
    latency: int = 1  # cycles
    amplifier_order: int = 2
    bungee: Bungee | None = None

    @classmethod
    def from_campaign(
        cls,
        folder: Path | str,
        overrides: Mapping[str, Any] | None = None,
        *,
        seed: int | None = None,
        files: Sequence[str] = (),
    ) -> Hardware:
        """Return the campaign's nominal hardware, or one drawn around it; or of other parameter `files` in its folder.

        With a `seed`, each number is drawn from a normal distribution with the stated sigma, cut
        at two sigmas; phases (`phi_*`) are drawn from the whole circle. `overrides` (SI, by dotted
        name; also `loop`, `latency`, `bungee`) come last and are taken as they are.
        """
        files = files or tomllib.loads((Path(folder) / "campaign.toml").read_text())["parameters"]["files"]
        tree: dict[str, Any] = {}
        for file in files:
            _merge(tree, tomllib.loads((Path(folder) / file).read_text()))
        leaves = {name: _quantity(leaf) for name, leaf in _leaves(tree)}
        hardware = cls(
            values={name: value for name, (value, _) in leaves.items()},
            sigmas={name: sigma for name, (_, sigma) in leaves.items()},
            loop=tree["controller"]["loop"],
            latency=tree["controller"]["latency"],
            amplifier_order=tree["transducer"]["amplifier"]["order"],
        )
        if seed is not None:
            hardware = hardware.drawn(np.random.default_rng(seed))
        return hardware.with_values(overrides or {})

    def drawn(self, rng: np.random.Generator) -> Hardware:
        """Return hardware drawn around this one's numbers; see `from_campaign`."""
        values = dict(self.values)
        for name in sorted(values):
            if name.startswith(_NOT_DRAWN):
                continue
            value, sigma = values[name], self.sigmas[name]
            if name.rpartition(".")[2].startswith("phi_"):
                values[name] = np.asarray(rng.uniform(-np.pi, np.pi))
            else:
                values[name] = value + sigma * _truncated_normal(rng, value.shape)
        return replace(self, values=values)

    def with_values(self, overrides: Mapping[str, Any]) -> Hardware:
        """Return the same hardware with some numbers replaced. Raises KeyError for an unknown name."""
        settings = {key: overrides[key] for key in ("loop", "latency", "bungee") if key in overrides}
        values = dict(self.values)
        for name, value in overrides.items():
            if name in settings:
                continue
            if name not in values:
                raise KeyError(f"the hardware has no {name!r}")
            values[name] = np.broadcast_to(np.asarray(value, dtype=float), values[name].shape).copy()
        return replace(self, values=values, **settings)

    def having(self, more: Mapping[str, Array]) -> Hardware:
        """Return the same hardware with numbers that its parameter files do not name."""
        return replace(self, values={**self.values, **more})

    def __getitem__(self, name: str) -> Array:
        return self.values[name]

    def cord(self) -> Bungee:
        """Return the bungee that the parameter files describe."""
        x, y, z = (self.scalar(f"external.bungee.anchor_{axis}") for axis in "xyz")
        a, b, c = self["external.bungee.point"].tolist()
        stiffness, free = (self.scalar(f"external.bungee.{name}") for name in ("stiffness", "free_length"))
        return Bungee((x, y, z), stiffness, free, hook=(a, b, c))

    def scalar(self, name: str) -> float:
        """Return a number that is not an array."""
        return float(self.values[name])

    def drive(self, axis: str, name: str) -> float:
        """Return one number of an axis's drive."""
        return self.scalar(f"joint.{axis}.drive.{name}")


def _truncated_normal(rng: np.random.Generator, shape: tuple[int, ...]) -> Array:
    """Standard normal numbers, drawn again until all lie within the truncation."""
    drawn = np.asarray(rng.standard_normal(shape))
    while np.any(outside := np.abs(drawn) > _TRUNCATION):
        drawn = np.where(outside, rng.standard_normal(shape), drawn)
    return drawn


def _merge(tree: dict[str, Any], other: Mapping[str, Any]) -> None:
    for key, value in other.items():
        if isinstance(value, dict) and isinstance(tree.get(key), dict):
            _merge(tree[key], value)
        else:
            tree[key] = value


def _leaves(tree: Mapping[str, Any], path: tuple[str, ...] = ()) -> Iterator[tuple[str, Mapping[str, Any]]]:
    for key, node in tree.items():
        if not isinstance(node, dict):
            continue
        here = path if key == "parameters" else (*path, key)
        if "value" in node:
            yield ".".join(here), node
        else:
            yield from _leaves(node, here)


def _quantity(leaf: Mapping[str, Any]) -> tuple[Array, Array]:
    """Value and sigma of one number or array, in SI, of the same shape."""
    value = np.asarray(leaf["value"], dtype=float)
    units = leaf["unit"]
    factor: Any = [_SI[unit] for unit in units] if isinstance(units, list) else _SI[units]
    sigma = np.broadcast_to(np.asarray(leaf["sigma"], dtype=float), value.shape)
    return value * np.asarray(factor), sigma * np.asarray(factor)
