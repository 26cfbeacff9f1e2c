"""From the merged parameter tables to a Rig: units to SI, shapes, bounds, and the chain of links."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from kbs_process.campaign.chain import order
from kbs_process.campaign.documents import Key, Merged, Tree
from kbs_process.campaign.problems import Problems
from kbs_process.campaign.quantities import CHANNELWISE, PAIRWISE, Kind, read_quantity
from kbs_process.errors import ConfigError, did_you_mean
from kbs_process.rig.model import (
    COORDINATE,
    LAB,
    TRANSDUCER,
    Amplifier,
    Body,
    Controller,
    Drive,
    Effort,
    Encoder,
    External,
    Joint,
    JointType,
    Quantity,
    Rig,
    Spacecraft,
    Transducer,
    no_transducer,
    unit_of,
)

# Units of a joint's viscous friction and effort, by the joint's type.
VISCOUS: dict[JointType, str] = {"revolute": "N m s/rad", "prismatic": "N s/m"}
EFFORT: dict[JointType, str] = {"revolute": "N m", "prismatic": "N"}

LENGTHS = Kind("m", (3,))
ANGLES = Kind("rad", (3,))


@dataclass(frozen=True, slots=True)
class RigBuilder:
    """Builds a rig out of tables that satisfy the schema; what is wrong is noted in `problems`.

    `drive_units` gives the SI unit of every drive parameter that an effect of the plant asks for, by name, at a joint
    that turns, and `external_units` those of the parameters of each effect of the laboratory, by its name.
    """

    tables: Merged
    folder: Path  # where CSV files of matrices are looked for
    drive_units: Mapping[str, str]
    external_units: Mapping[str, Mapping[str, str]]
    problems: Problems

    def build(self) -> Rig:
        """Return the rig; it is to be trusted only if `problems` is empty afterwards."""
        tree = self.tables.tree
        bench = tree.get("transducer")
        joints = order(tree["joint"], bench and bench["on"], self.tables, self.problems)
        links = {LAB, *((TRANSDUCER,) if bench else ()), *joints}
        return Rig(
            gravity=self._quantity(Kind("m/s^2", (), low=0.0), "gravity", "magnitude"),
            transducer=self._transducer(bench) if bench else no_transducer(),
            bodies=tuple(self._body(name, table, links) for name, table in tree.get("body", {}).items()),
            joints=tuple(self._joint(name, tree["joint"][name]) for name in joints),
            controller=self._controller(tree["controller"], joints) if "controller" in tree else None,
            spacecraft=self._spacecraft() if "spacecraft" in tree else None,
            external=tuple(self._external(name, table, links) for name, table in tree.get("external", {}).items()),
        )

    def _quantity(self, kind: Kind, *key: str) -> Quantity:
        node: Any = self.tables.tree
        for part in key:
            node = node[part]
        try:
            return read_quantity(".".join(key), node, kind, self.folder)
        except ConfigError as error:
            self.problems.add(self.tables.place((*key, *filter(None, [error.where]))), error.what, error.remedy)
            zero = np.zeros(kind.shape)
            return Quantity(".".join(key), zero, "", zero, "")

    def _transducer(self, table: Tree) -> Transducer:
        channels = tuple(table["channels"])

        def quantity(kind: Kind, *key: str) -> Quantity:
            return self._quantity(kind, "transducer", *key)

        def each_channel(name: str) -> Quantity:
            low = None if name == "bias" else 0.0
            return quantity(Kind(CHANNELWISE, (6,), low=low, channels=channels), name)

        elastic = "stiffness" in table
        corner = Kind("Hz", (), low=0.0, strict=True)
        return Transducer(
            on=table["on"],
            channels=channels,
            tilt=quantity(Kind("rad", (2,)), "tilt"),
            stiffness=quantity(Kind("N m/rad", (3,), low=0.0, strict=True), "stiffness") if elastic else None,
            damping=quantity(Kind("N m s/rad", (3,), low=0.0), "damping") if elastic else None,
            cross_coupling=quantity(Kind(PAIRWISE, (6, 6)), "cross_coupling"),
            bias=each_channel("bias"),
            noise=each_channel("noise"),
            resolution=each_channel("resolution"),
            amplifier=Amplifier(table["amplifier"]["order"], quantity(corner, "amplifier", "corner"))
            if "amplifier" in table
            else None,
        )

    def _body(self, name: str, table: Tree, links: set[str]) -> Body:
        if table["on"] not in links:
            self._unknown(("body", name, "on"), table["on"], "link", links)
        inertia = self._quantity(Kind("kg m^2", (6,)), "body", name, "inertia")
        self._check_inertia(inertia)
        return Body(
            name=name,
            on=table["on"],
            mass=self._quantity(Kind("kg", (), low=0.0), "body", name, "mass"),
            cog=self._quantity(LENGTHS, "body", name, "cog"),
            inertia=inertia,
        )

    def _check_inertia(self, inertia: Quantity) -> None:
        xx, yy, zz, xy, xz, yz = inertia.value
        least = float(np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])[0])
        if least < -1e-9 * float(np.abs(inertia.value).max()):
            self.problems.add(
                self.tables.place(tuple(inertia.name.split("."))),
                f"is the inertia of no body: its least principal moment is {least:.3g} kg m^2",
                "check order (xx, yy, zz, xy, xz, yz) and signs (tensor elements: xy = -sum m x y)",
            )

    def _joint(self, name: str, table: Tree) -> Joint:
        axis = np.asarray(table["axis"], dtype=float)
        length = float(np.linalg.norm(axis))
        if length == 0.0:
            place = self.tables.place(("joint", name, "axis"))
            self.problems.add(place, "has no direction", "give a direction, such as [0, 0, 1]")
        x, y, z = (axis / (length or 1.0)).tolist()
        kind: JointType = table.get("type", "revolute")
        return Joint(
            name=name,
            parent=table["parent"],
            axis=(x, y, z),
            origin=self._quantity(LENGTHS, "joint", name, "origin"),
            misalignment=self._quantity(ANGLES, "joint", name, "misalignment"),
            encoder=self._encoder(name, COORDINATE[kind]) if "encoder" in table else None,
            drive=self._drive(name, kind, table["drive"]) if "drive" in table else None,
            type=kind,
            viscous=self._quantity(Kind(VISCOUS[kind], (), low=0.0), "joint", name, "viscous")
            if "viscous" in table
            else None,
            effort=self._effort(name, EFFORT[kind], table["effort"]) if "effort" in table else None,
        )

    def _encoder(self, joint: str, unit: str) -> Encoder:
        return Encoder(
            step=self._quantity(Kind(unit, (), low=0.0), "joint", joint, "encoder", "step"),
            offset=self._quantity(Kind(unit, ()), "joint", joint, "encoder", "offset"),
        )

    def _effort(self, joint: str, unit: str, table: Tree) -> Effort:
        """A force or torque (gain "1"), or the current or voltage that makes it, as the gain's unit says."""
        readings = {"1": unit, f"{unit}/A": "A", f"{unit}/V": "V"}
        given = table["gain"]["unit"]
        if given not in readings:
            place = self.tables.place(("joint", joint, "effort", "gain", "unit"))
            what = f"'{given}' is the unit of no gain of this joint's effort"
            self.problems.add(place, what, f"give one of {', '.join(map(repr, readings))}")
            given = "1"

        def quantity(name: str, kind: Kind) -> Quantity:
            return self._quantity(kind, "joint", joint, "effort", name)

        reading = readings[given]
        return Effort(
            unit=reading,
            gain=quantity("gain", Kind(given, (), low=0.0, strict=True)),
            bias=quantity("bias", Kind(reading, ())),
            noise=quantity("noise", Kind(reading, (), low=0.0)),
            resolution=quantity("resolution", Kind(reading, (), low=0.0)),
        )

    def _drive(self, joint: str, kind: JointType, table: Tree) -> Drive:
        def positive(name: str, unit: str, strict: bool = True) -> Quantity:
            return self._quantity(Kind(unit, (), low=0.0, strict=strict), "joint", joint, "drive", name)

        parameters = {}
        for name in table.get("parameters", {}):
            key = ("joint", joint, "drive", "parameters", name)
            if name not in self.drive_units:
                self._unknown(key, name, "parameter of an effect", self.drive_units)
                continue
            quantity = self._quantity(Kind(unit_of(kind, self.drive_units[name]), ()), *key)
            # One name for all who refer to it: "joint.el.drive.Ka", short of the table's name.
            parameters[name] = Quantity(
                f"joint.{joint}.drive.{name}", quantity.value, quantity.unit, quantity.sigma, quantity.source
            )
        return Drive(
            ratio=positive("ratio", "1"),
            # The rotor of a direct drive is part of the body that it moves.
            rotor_inertia=positive("rotor_inertia", "kg m^2", strict=False),
            steps_per_turn=positive("steps_per_turn", "1"),
            parameters=parameters,
        )

    def _controller(self, table: Tree, joints: tuple[str, ...]) -> Controller:
        each = (len(joints),)
        return Controller(
            cycle=self._quantity(Kind("s", (), low=0.0, strict=True), "controller", "cycle"),
            loop=table["loop"],
            Kp=self._quantity(Kind("1", each), "controller", "Kp"),
            Ki=self._quantity(Kind("1/s", each), "controller", "Ki"),
            latency=table["latency"],
        )

    def _spacecraft(self) -> Spacecraft:
        return Spacecraft(
            position=self._quantity(LENGTHS, "spacecraft", "position"),
            attitude=self._quantity(ANGLES, "spacecraft", "attitude"),
        )

    def _external(self, effect: str, table: Tree, links: set[str]) -> External:
        key = ("external", effect)
        units = self.external_units.get(effect)
        if units is None:
            self._unknown(key, effect, "effect of the laboratory on a rig", set(self.external_units))
            units = {}
        if table["on"] not in links:
            self._unknown((*key, "on"), table["on"], "link", links)
        parameters = {}
        for name in table.get("parameters", {}):
            if name not in units:
                self._unknown((*key, "parameters", name), name, f"parameter of '{effect}'", units)
                continue
            quantity = self._quantity(Kind(units[name], ()), *key, "parameters", name)
            parameters[name] = replace(quantity, name=f"external.{effect}.{name}")
        point = self._quantity(LENGTHS, *key, "point") if "point" in table else None
        return External(name=effect, on=table["on"], point=point, parameters=parameters)

    def _unknown(self, key: Key, found: str, role: str, known: set[str] | Mapping[str, str]) -> None:
        self.problems.add(self.tables.place(key), f"'{found}' is no {role}", did_you_mean(found, known))
