"""A suspect in the non-linear plant, refitted together with all known parameters.

The bodies keep the slopes that they were fitted with, as the steps correct them; those of the drives and the suspect's
own are taken anew where the steps want it. What acts on the readings alone has a column of the prediction for each of
its numbers.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from kbs_process.diagnosis.experiments.hypothesis import Hypothesis, Prediction, Simulate
from kbs_process.diagnosis.nominal.costs import GEARS, Found, Laws, added
from kbs_process.diagnosis.nominal.known import Known, as_it_is, known_of, resumed, settled
from kbs_process.diagnosis.nominal.search import Search
from kbs_process.identification.output_error import Scalar
from kbs_process.plant.attach import detach, idle
from kbs_process.plant.laws import select
from kbs_process.signals.records import Array

_STEPS = 12
_TRIES, _LESS = 3, 0.2


@dataclass(frozen=True, slots=True, eq=False)
class Extra:
    """Numbers of one suspect: those of the rig, and those that multiply columns of the prediction."""

    hypothesis: Hypothesis  # with the suspect's effect in its plant, if it has one
    plant: tuple[Scalar, ...]  # numbers of its rig
    start: Array  # (plant + linear,)
    prior: Array  # (plant + linear,) means, and
    sigma: Array  # their standard deviations
    scale: Array  # (plant + linear,) sizes of steps
    lower: Array  # (plant + linear,) bounds
    upper: Array
    linear: tuple[Scalar, ...] = ()
    columns: Mapping[int, Array] | None = None  # by reference drive, (linear, n, c)


@dataclass(frozen=True, slots=True, eq=False)
class Standing:
    """What is believed at a time: the known parameters with those of all accepted laws, and what they predict."""

    known: Known
    predicted: Mapping[int, Prediction]  # by drive, of all drives, the plant's
    laws: Laws  # of numbers that are no rig's

    @property
    def hypothesis(self) -> Hypothesis:
        return self.known.hypothesis

    def shown(self, trial: int) -> Array:
        """(n, c) prediction of a trial with all laws in it."""
        known = self.known
        one = known.experiment.trials[trial]
        reference = known.experiment.reference(one.trajectory)
        return self.predicted[one.drive].values + added(self.laws, known.free, known.value, reference)


@dataclass(frozen=True, slots=True, eq=False)
class Entered:
    """A refit with a suspect's numbers beside the others, as far as it has come."""

    search: Search
    found: Found
    before: Array  # chi2 that the known numbers had before any refit

    def on(self, steps: int) -> Entered:
        """Some more steps, along the slopes that the known numbers had; none of a plant that diverged."""
        if self.found.converged or not np.isfinite(self.left):
            return self
        return replace(self, found=self.search.descend(self.found, steps, most=GEARS, giving_up=True))

    def ended(self) -> Entered:
        """The same with the slopes that a next step would want, for whoever goes on from there."""
        return replace(self, found=self.search.with_slopes(self.found))

    @property
    def left(self) -> float:
        """-2 log likelihood beyond that of noise."""
        return self.search.left(self.found)

    @property
    def standing(self) -> Standing:
        """What is believed there."""
        return standing_of(known_of(self.search, self.found, self.before), self.search.laws)


def with_extra(standing: Standing, extra: Extra, simulate: Simulate, steps: int = _STEPS) -> Standing:
    """Refit all numbers of `standing` with a suspect's beside them, along the slopes that the known ones had.

    After the first few `steps`, `moved_on` takes it to its end.
    """
    return entered(standing, extra, simulate).on(steps).ended().standing


def entered(standing: Standing, extra: Extra, simulate: Simulate) -> Entered:
    """A refit that begins with a suspect's numbers beside those of `standing`."""
    known, experiment = standing.known, standing.known.experiment
    laws = dict(standing.laws)
    for index, scalar in enumerate(extra.linear):
        laws[scalar.name] = {drive: columns[index] for drive, columns in (extra.columns or {}).items()}
    names = [scalar.name for scalar in (*extra.plant, *extra.linear)]
    parameters = known.parameters.extended(names, extra.prior, extra.sigma, extra.lower, extra.upper)
    search = Search(
        experiment,
        known.metric,
        simulate,
        extra.hypothesis,
        (*known.free, *extra.plant, *extra.linear),
        parameters,
        laws,
        np.concatenate([known.scale, extra.scale]),
    )
    start = extra.start
    for _ in range(_TRIES):
        theta = np.concatenate([known.value, start])
        predicted = search.predict([theta], search.drives)[0]
        if np.isfinite(search.cost(theta, predicted)[0]):
            break
        # Too strong for the plant to run: the search then begins with less of it.
        start = extra.prior + _LESS * (start - extra.prior)
    return Entered(search, search.begin(theta, dict(known.slopes), predicted), known.chi2_before)


def moved_on(standing: Standing, simulate: Simulate, *, leaps: bool = True) -> Standing:
    """The refit of `with_extra` taken to its end: to better phases first, which made up for what was left out.

    Without `leaps` phases are taken to be right.
    """
    known = standing.known
    if not np.isfinite(known.cost):
        return standing
    moved = resumed(known, simulate, laws=standing.laws, leaps=leaps)
    return standing_of(moved, standing.laws) if moved.cost < known.cost else standing


@dataclass(frozen=True, slots=True)
class Own:
    """Names of a law's numbers among all that are fitted."""

    names: tuple[str, ...]
    amplitudes: tuple[str, ...]  # those of them without which the law does nothing

    def __add__(self, other: Own) -> Own:
        return Own((*self.names, *other.names), (*self.amplitudes, *other.amplitudes))


def without(standing: Standing, own: Own, simulate: Simulate) -> Standing:
    """Refit all other numbers of `standing` with a law taken out."""
    rest, laws = _stripped(standing, own)
    return standing_of(settled(rest, simulate, leaps=1, laws=laws), laws)


def bare(standing: Standing, own: Own, simulate: Simulate) -> Standing:
    """All other numbers of `standing` where they are, with a law taken out, and what that leaves."""
    rest, laws = _stripped(standing, own)
    return standing_of(as_it_is(rest, simulate, laws=laws), laws)


def _stripped(standing: Standing, own: Own) -> tuple[Known, Laws]:
    known = standing.known
    inside = [one for one in known.free if one.name in own.amplitudes and one.name not in standing.laws]
    still = known.hypothesis.at(inside, np.zeros(len(inside)))
    others = [i for i, name in enumerate(known.names) if name not in own.names]
    free = tuple(known.free[i] for i in others)
    rest = replace(
        known,
        hypothesis=_less(still, known.experiment.effects, free),
        free=free,
        parameters=known.parameters.chosen(others),
        scale=known.scale[others],
        value=known.value[others],
        shown={},
        slopes={
            drive: replace(one, columns=one.columns[others], taken=one.taken[others])
            for drive, one in known.slopes.items()
        },
    )
    return rest, {name: columns for name, columns in standing.laws.items() if name not in own.names}


def _less(hypothesis: Hypothesis, given: Sequence[str], free: Sequence[Scalar]) -> Hypothesis:
    """A hypothesis without those effects that are not `given` and do nothing, and have no number that is `free`."""
    rig, effects = hypothesis.rig, hypothesis.effects
    fitted = {scalar.quantity.rpartition(".")[2] for scalar in free}
    for effect in select(effects):
        own = {entry.name for entry in effect.parameters if entry.role != "shared"}
        if effect.name not in given and not own & fitted and idle(rig, effect):
            effects = tuple(name for name in effects if name != effect.name)
            rig = detach(rig, effect, select(effects))
    return Hypothesis(rig, effects)


def standing_of(known: Known, laws: Laws) -> Standing:
    """What is believed, with the plant's own predictions."""
    if not laws:
        return Standing(known, known.shown, laws)
    experiment = known.experiment
    alike = {trial.drive: experiment.reference(trial.trajectory) for trial in experiment.trials}
    own = {
        drive: replace(shown, values=shown.values - added(laws, known.free, known.value, alike[drive]))
        for drive, shown in known.shown.items()
    }
    return Standing(known, own, laws)
