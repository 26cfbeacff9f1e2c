"""The linear loop over the range of one joint: margins, poles, critical gains, and what they depend on."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from kbs_process.campaign.config import Campaign
from kbs_process.errors import ConfigError, did_you_mean
from kbs_process.plant.laws import select
from kbs_process.plant.linear.linearise import Linear, linearise
from kbs_process.plant.structure import structure_of
from kbs_process.results.tables import write_table
from kbs_process.rig.model import Controller, Rig, substitute
from kbs_process.signals.records import Array
from kbs_process.studies.stability import loop
from kbs_process.studies.stability.onset import smooth_rig
from kbs_process.studies.stability.results import Boundary, CriticalAt, LoopMargins, Sensitivity

_WEIGHTS = (0.0, 0.5, 1.0, 2.0, 4.0, 7.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0, 45.0, 50.0)  # of Ki over Kp
_SWEPT = 200.0  # Hz, of the modes in the map of poles


@dataclass(frozen=True, slots=True, eq=False)
class Sweep:
    """A campaign's loop over the angle of one joint, the others at zero."""

    rig: Rig
    effects: tuple[str, ...]
    controller: Controller
    joint: str

    def pose(self, angle: float) -> Array:
        """Return the joints' angles."""
        return np.array([angle if name == self.joint else 0.0 for name in self.rig.joint_names])

    def linear(self, angle: float, rig: Rig | None = None) -> Linear:
        """Linearise without friction, or `rig` as it is."""
        return linearise(rig or smooth_rig(self.rig), select(self.effects), self.pose(angle))

    def margins(self, angle: float) -> Iterator[LoopMargins]:
        """Yield the margins of every joint's loop."""
        cut = loop.loop(self.linear(angle), self.controller)
        for joint in cut.joints:
            yield loop.margins(cut, joint, angle)

    def critical(self, angle: float) -> CriticalAt:
        """Return the critical factor without friction, and with the slopes that it has at standstill."""
        found = loop.critical(self.linear(angle), self.controller)
        resting = loop.critical(self.linear(angle, self.rig), self.controller)
        return CriticalAt(
            angle_rad=float(angle),
            factor=loop.finite(found.factor),
            frequency_Hz=found.frequency if np.isfinite(found.factor) else None,
            at_rest=loop.finite(resting.factor),
        )

    def boundary(self, angle: float) -> Iterator[Boundary]:
        """Yield the stability boundary in the plane of both gains."""
        system = self.linear(angle)
        for weight in _WEIGHTS:
            factor = loop.critical(system, self.controller, integral=weight).factor
            if np.isfinite(factor):
                yield Boundary(integral_weight=weight, proportional=factor, integral=weight * factor)

    def sensitivities(self, angle: float) -> tuple[Sensitivity, ...]:
        """Move every uncertain number of the rig by a sigma; those of a quantity add in squares."""
        nominal = loop.critical(self.linear(angle), self.controller).factor
        if not np.isfinite(nominal):
            return ()

        def change(name: str, value: Array) -> float:
            moved = self.linear(angle, smooth_rig(substitute(self.rig, {name: value})))
            return loop.critical_near(moved, self.controller, nominal) - nominal

        found = []
        for name, quantity in self.rig.quantities().items():
            if name.split(".")[0] not in ("body", "joint", "transducer") or not np.any(quantity.sigma > 0.0):
                continue
            changes = []
            for index in np.argwhere(quantity.sigma > 0.0):
                value = quantity.value.copy()
                value[tuple(index)] += quantity.sigma[tuple(index)]
                changes.append(change(name, value))
            sigma = float(np.linalg.norm(changes))
            if sigma > 1e-4 * nominal:
                found.append(Sensitivity(name=name, sigma_of_factor=sigma))
        return tuple(sorted(found, key=lambda entry: -entry.sigma_of_factor))

    def write_poles(self, folder: Path, angles: Array) -> None:
        """Write the poles of the plant alone (true frequencies) and of the closed loop (folded below half its rate)."""
        rows: list[tuple[float, float, float, float]] = []
        for angle in angles:
            system = self.linear(angle)
            plant, closed = loop.natural(system), loop.poles(loop.loop(system, self.controller))
            for closes, values in ((0.0, plant), (1.0, closed)):
                for pole in values[values.imag >= 0.0]:
                    frequency = float(pole.imag / (2.0 * np.pi))
                    if 1e-6 < frequency < _SWEPT:
                        rows.append((float(angle), closes, frequency, float(-pole.real / abs(pole))))
        names = {"angle": "rad", "closed": "1", "frequency": "Hz", "damping": "1"}
        table = {name: np.ascontiguousarray(column) for name, column in zip(names, np.array(rows).T, strict=True)}
        write_table(folder / "tables" / "stability" / "poles.parquet", table, names)


def sweep_of(campaign: Campaign, joint: str | None) -> Sweep:
    """Return the sweep over a joint of the campaign (default: the last one).

    Raises ConfigError where there is no such joint, no controller, or no plant that a controller could drive.
    """
    controller, names = campaign.rig.controller, campaign.rig.joint_names
    if campaign.drive == "motion" or controller is None:
        raise ConfigError(
            "this campaign has no controller whose loop could be analysed",
            where=campaign.name,
            remedy='describe [controller] and set drive = "command"',
        )
    swept = names[-1] if joint is None else joint
    if swept not in names:
        raise ConfigError(f"there is no joint '{swept}'", where=campaign.name, remedy=did_you_mean(swept, names))
    structure_of(campaign.rig, select(campaign.effects))  # refuses a rig without drives or on a turning transducer
    return Sweep(campaign.rig, campaign.effects, controller, swept)
