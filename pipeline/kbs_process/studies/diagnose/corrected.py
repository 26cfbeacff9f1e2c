"""The corrected model of a diagnosis: known parameters as refitted, and every law that was found where it belongs."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from kbs_process.campaign.config import Campaign, SensingLaw
from kbs_process.campaign.sensing_laws import belongs_to_model
from kbs_process.campaign.writing.corrected_model import write_model
from kbs_process.diagnosis.acceptance.outcome import Find, Outcome
from kbs_process.diagnosis.experiments.hypothesis import Hypothesis
from kbs_process.diagnosis.facts import Estimate
from kbs_process.plant.effect import Uniform
from kbs_process.plant.laws import LAWS, SENSING, select
from kbs_process.plant.sensing import BY
from kbs_process.rig.model import Quantity, substitute
from kbs_process.signals.records import Array

CORRECTED = "corrected"  # folder of the model, in that of the results
_SENSORS = {law.name: law for law in SENSING}
_EACH_TIME = {name for name, law in LAWS.items() if law.each_trial}


def left_out(find: Find) -> bool:
    """Whether a find is in no model: each recording's own."""
    return find.identity.law in _EACH_TIME


def write_corrected(campaign: Campaign, outcome: Outcome, folder: Path) -> tuple[Path, ...]:
    """Write the model into `folder`; return its files."""
    known = outcome.standing.known
    source = "by diagnosis of " + ", ".join(known.experiment.trials[k].name for k in known.experiment.fit)
    hypothesis = _within_a_turn(outcome.standing.hypothesis)
    quantities = hypothesis.rig.quantities()
    changed: dict[str, Quantity] = {}
    for index, scalar in enumerate(known.free):
        if scalar.quantity in quantities:
            quantity = changed.get(scalar.quantity, quantities[scalar.quantity])
            sigma = quantity.sigma.copy()
            sigma[scalar.element] = known.sigma[index]
            changed[scalar.quantity] = replace(quantity, sigma=sigma, source=source)
    sensing = tuple(_sensing(find, own, source) for find in outcome.finds if _reads(find) for own in find.actions)
    return write_model(campaign, hypothesis.rig, hypothesis.effects, changed, folder, source, sensing)


def _within_a_turn(hypothesis: Hypothesis) -> Hypothesis:
    """The same with every phase in the turn that its effect declares: a search may go round."""
    turns = {
        entry.name: entry.prior.low
        for effect in select(hypothesis.effects)
        for entry in effect.parameters
        if isinstance(entry.prior, Uniform) and np.isclose(entry.prior.high - entry.prior.low, 2.0 * np.pi)
    }
    phases: dict[str, Array | float] = {}
    for name, quantity in hypothesis.rig.quantities().items():
        low = turns.get(name.rpartition(".")[2])
        if low is not None and not quantity.shape:
            phases[name] = low + (float(quantity) - low) % (2.0 * np.pi)
    return replace(hypothesis, rig=substitute(hypothesis.rig, phases))


def _reads(find: Find) -> bool:
    """Whether a find is a law of a sensor or its clock that is the same in every recording."""
    law = _SENSORS.get(find.identity.law)
    return law is not None and belongs_to_model(law)


def _sensing(find: Find, estimates: Sequence[Estimate], source: str) -> SensingLaw:
    """A find, or one of its actions, as the model's sensors have it."""
    law, own = _SENSORS[find.identity.law], find.identity
    site = BY.join(own.place.channels) or own.place.site
    numbers = {}
    for one in estimates:
        # A second action of the same law has numbered amplitudes.
        entry = next(entry for entry in law.parameters if re.fullmatch(rf"{entry.name}(_\d+)?", one.name))
        name = f"sensing.{site}.{law.name}.{entry.name}"
        numbers[entry.name] = Quantity(name, np.asarray(one.value), entry.unit, np.asarray(one.sigma), source)
    return SensingLaw(law.name, site, numbers)
