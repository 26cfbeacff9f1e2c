"""From the merged parameter tables to a Rig: units to SI, shapes, bounds, and the chain of links."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path

import numpy as np

from kbs_process.campaign.chain import order
from kbs_process.campaign.documents import Key, Merged
from kbs_process.campaign.formats.kind import CHANNELWISE, Kind
from kbs_process.campaign.formats.parameter_file import (
    BodyTable,
    ControllerTable,
    DriveTable,
    EffortTable,
    ExternalTable,
    InertialTable,
    JointTable,
    ParameterFile,
    TransducerTable,
)
from kbs_process.campaign.formats.tables import PlainQuantity, QuantityTable, Table, quantities
from kbs_process.campaign.problems import Problems
from kbs_process.campaign.quantities import quantity_or_fault
from kbs_process.errors import did_you_mean
from kbs_process.plant.effect import Effect
from kbs_process.rig.model import (
    LAB,
    TRANSDUCER,
    Amplifier,
    Body,
    Controller,
    Drive,
    Effort,
    Encoder,
    External,
    Inertial,
    Joint,
    JointType,
    Quantity,
    Rig,
    Spacecraft,
    Transducer,
    no_transducer,
    unit_of,
)

_MOST_COUPLED = 1e6  # condition of a transducer's matrix, its rows scaled


@dataclass(frozen=True, slots=True)
class RigBuilder:
    """Builds a rig out of parameter files; what is wrong is noted in `problems`.

    `effects` are those that may act: the catalogue's, and what the model names besides.
    """

    given: ParameterFile
    tables: Merged  # the same as read, with their places
    folder: Path  # where CSV files of matrices are looked for
    effects: Iterable[Effect]
    problems: Problems

    def build(self) -> Rig:
        """Return the rig; it is to be trusted only if `problems` is empty afterwards."""
        given = self.given
        bench, controller, spacecraft = given.transducer, given.controller, given.spacecraft
        parents = {name: joint.parent for name, joint in given.joint.items()}
        joints = order(parents, bench.on if bench else None, self.tables, self.problems)
        links = {LAB, *((TRANSDUCER,) if bench else ()), *joints}
        return Rig(
            gravity=self._quantities(given.gravity, "gravity")["magnitude"],
            transducer=self._transducer(bench) if bench else no_transducer(),
            bodies=tuple(self._body(name, table, links) for name, table in given.body.items()),
            joints=tuple(self._joint(name, given.joint[name]) for name in joints),
            controller=self._controller(controller, joints) if controller else None,
            spacecraft=Spacecraft(**self._quantities(spacecraft, "spacecraft")) if spacecraft else None,
            external=tuple(self._external(name, table, links) for name, table in given.external.items()),
            instruments={
                name: self._inertial(name, table, links)
                for name, table in (("accelerometer", given.accelerometer), ("gyro", given.gyro))
                if table is not None
            },
        )

    def _quantities(
        self, table: Table, *key: str, joint: JointType = "revolute", joints: int = 0, channels: tuple[str, ...] = ()
    ) -> dict[str, Quantity]:
        """Return those quantities of a table whose kinds its format states, by key."""
        found = {}
        for name, kind, given in quantities(table):
            here = replace(
                kind,
                unit=unit_of(joint, kind.unit) if kind.of_joint else kind.unit,
                shape=(joints,) if kind.each_joint else kind.shape,
                channels=channels if kind.unit == CHANNELWISE else (),
            )
            found[name] = self._quantity(given, here, *key, name)
        return found

    def _quantity(self, given: QuantityTable | PlainQuantity, kind: Kind, *key: str) -> Quantity:
        quantity, fault = quantity_or_fault(".".join(key), given, kind, self.folder)
        if fault:
            self.problems.add(self.tables.place((*key, fault.where)), fault.what, fault.remedy)
        return quantity

    def _named(
        self, given: Mapping[str, QuantityTable], units: Mapping[str, str], role: str, *key: str
    ) -> dict[str, Quantity]:
        """Return the parameters of effects in a table [... parameters]; their units are known by name."""
        found = {}
        for name, table in given.items():
            if name in units:
                quantity = self._quantity(table, Kind(units[name]), *key, name)
                # One name for all who refer to it: "joint.el.drive.Ka", short of the table's name.
                found[name] = replace(quantity, name=".".join((*key[:-1], name)))
            else:
                self._unknown((*key, name), name, role, units)
        return found

    def _transducer(self, table: TransducerTable) -> Transducer:
        channels = tuple(table.channels)
        own = self._quantities(table, "transducer", channels=channels)
        self._check_coupling(own["cross_coupling"])
        amplifier = table.amplifier
        return Transducer(
            on=table.on,
            channels=channels,
            amplifier=Amplifier(amplifier.order, **self._quantities(amplifier, "transducer", "amplifier"))
            if amplifier
            else None,
            stiffness=own.pop("stiffness", None),
            damping=own.pop("damping", None),
            **own,
        )

    def _check_coupling(self, coupling: Quantity) -> None:
        """The wrench is what the channels read, times the inverse of I + coupling."""
        matrix = np.eye(len(coupling.value)) + coupling.value
        scale = np.abs(matrix).max(axis=1, keepdims=True)  # rows of forces and of torques have other units
        if not scale.all() or np.linalg.cond(matrix / np.where(scale == 0.0, 1.0, scale)) > _MOST_COUPLED:
            place = self.tables.place(("transducer", "cross_coupling", "value"))
            what = "leaves channels that tell nothing of their own: I + cross_coupling cannot be inverted"
            self.problems.add(place, what, "give what a channel reads of others only, without its own 1")

    def _body(self, name: str, table: BodyTable, links: set[str]) -> Body:
        if table.on not in links:
            self._unknown(("body", name, "on"), table.on, "link", links)
        body = Body(name=name, on=table.on, **self._quantities(table, "body", name))
        self._check_inertia(body.inertia)
        return replace(body, inertia=replace(body.inertia, low=np.array([0.0] * 3 + [-np.inf] * 3)))

    def _check_inertia(self, inertia: Quantity) -> None:
        greatest = float(np.abs(inertia.value).max()) or 1.0
        xx, yy, zz, xy, xz, yz = inertia.value / greatest
        least = float(np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])[0])
        if least < -1e-9:
            self.problems.add(
                self.tables.place(tuple(inertia.name.split("."))),
                f"is the inertia of no body: its least principal moment is {least * greatest:.3g} kg m^2",
                "check order (xx, yy, zz, xy, xz, yz) and signs (tensor elements: xy = -sum m x y)",
            )

    def _joint(self, name: str, table: JointTable) -> Joint:
        axis = np.asarray(table.axis)
        with np.errstate(over="ignore"):
            length = float(np.linalg.norm(axis))
        if length == 0.0 or not isfinite(length):
            place = self.tables.place(("joint", name, "axis"))
            self.problems.add(place, "has no direction", "give a direction, such as [0, 0, 1]")
        own = self._quantities(table, "joint", name, joint=table.type)
        x, y, z = (axis / (length or 1.0)).tolist()
        return Joint(
            name=name,
            parent=table.parent,
            axis=(x, y, z),
            type=table.type,
            encoder=Encoder(**self._quantities(table.encoder, "joint", name, "encoder", joint=table.type))
            if table.encoder
            else None,
            drive=self._drive(name, table.type, table.drive) if table.drive else None,
            effort=self._effort(name, unit_of(table.type, "N m"), table.effort) if table.effort else None,
            viscous=own.pop("viscous", None),
            **own,
        )

    def _effort(self, joint: str, unit: str, table: EffortTable) -> Effort:
        """A force or torque (gain "1"), or the current or voltage that makes it, as the gain's unit says."""
        readings = {"1": unit, f"{unit}/A": "A", f"{unit}/V": "V"}
        given = str(table.gain.unit)
        if given not in readings:
            place = self.tables.place(("joint", joint, "effort", "gain", "unit"))
            what = f"'{given}' is the unit of no gain of this joint's effort"
            self.problems.add(place, what, f"give one of {', '.join(map(repr, readings))}")
            given = "1"

        def quantity(name: str, kind: Kind) -> Quantity:
            return self._quantity(getattr(table, name), kind, "joint", joint, "effort", name)

        reading = readings[given]
        return Effort(
            unit=reading,
            gain=quantity("gain", Kind(given, low=0.0, strict=True)),
            bias=quantity("bias", Kind(reading)),
            noise=quantity("noise", Kind(reading, low=0.0)),
            resolution=quantity("resolution", Kind(reading, low=0.0)),
        )

    def _drive(self, joint: str, kind: JointType, table: DriveTable) -> Drive:
        units = {
            parameter.name: unit_of(kind, parameter.unit)
            for effect in self.effects
            if effect.port.of_drive
            for parameter in effect.parameters
        }
        key = ("joint", joint, "drive")
        return Drive(
            parameters=self._named(table.parameters, units, "parameter of an effect", *key, "parameters"),
            **self._quantities(table, *key),
        )

    def _controller(self, table: ControllerTable, joints: Collection[str]) -> Controller:
        own = self._quantities(table, "controller", joints=len(joints))
        return Controller(loop=table.loop, latency=table.latency, **own)

    def _external(self, effect: str, table: ExternalTable, links: set[str]) -> External:
        key = ("external", effect)
        known = {
            other.name: {parameter.name: parameter.unit for parameter in other.parameters}
            for other in self.effects
            if not other.port.of_drive
        }
        if effect not in known:
            self._unknown(key, effect, "effect of the laboratory on a rig", known)
        if table.on not in links:
            self._unknown((*key, "on"), table.on, "link", links)
        units = known.get(effect, {})
        parameters = self._named(table.parameters, units, f"parameter of '{effect}'", *key, "parameters")
        return External(
            name=effect, on=table.on, parameters=parameters, **({"point": None} | self._quantities(table, *key))
        )

    def _inertial(self, name: str, table: InertialTable, links: set[str]) -> Inertial:
        if table.on not in links:
            self._unknown((name, "on"), table.on, "link", links)
        return Inertial(on=table.on, **self._quantities(table, name))

    def _unknown(self, key: Key, found: str, role: str, known: Iterable[str]) -> None:
        self.problems.add(self.tables.place(key), f"'{found}' is no {role}", did_you_mean(found, known))
