"""Known numbers that settle beside a law: refitted from where they are, or drawn back and let go again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.diagnosis.experiments.floor import Floor
from kbs_process.diagnosis.experiments.hypothesis import Simulate
from kbs_process.diagnosis.experiments.thresholds import CLOSE, MOST, NOMINAL
from kbs_process.diagnosis.nominal.detection import Detection, detect
from kbs_process.diagnosis.nominal.joint import Standing, standing_of
from kbs_process.diagnosis.nominal.known import confined, settled


def resettled(standing: Standing, floor: Floor, simulate: Simulate, *, leaps: int) -> Standing:
    """All numbers refitted with the law in the plant, or on its prediction, if that takes away more."""
    known = standing.known
    at_floor = not detected(standing, floor, known.experiment.fit).left
    if not searched(known.experiment) or (leaps and at_floor):
        return standing
    moved = settled(known, simulate, leaps=leaps, laws=standing.laws)
    return standing_of(moved, standing.laws) if moved.cost < known.cost else standing


def drawn_back(standing: Standing, floor: Floor, simulate: Simulate) -> Standing:
    """Known numbers nearer to their priors, where something that is missing has pulled them.

    Laws are looked for from there: they act on the plant that is, and numbers that made up for one of them have made
    it another. Where something is left, the numbers are drawn back if less than twice as much is left then.
    """
    known = standing.known
    if not (searched(known.experiment) and known.strained):
        return standing
    held = confined(known, simulate, CLOSE, laws=standing.laws)
    kept = not bent(standing, floor) and not MOST * held.excess < known.excess
    return standing if kept else standing_of(held, standing.laws)


def nominal(standing: Standing, simulate: Simulate) -> Standing:
    """Known numbers nearly where the files have them: what they have taken up shows there."""
    return standing_of(confined(standing.known, simulate, NOMINAL, laws=standing.laws), standing.laws)


def bent(standing: Standing, floor: Floor) -> bool:
    """Whether known numbers leave nothing, but are all together farther off than chance has them.

    A law that they have taken up leaves nothing to see in the recordings that they were fitted to.
    """
    known = standing.known
    return known.strained and not detected(standing, floor, known.experiment.fit).left


def released(standing: Standing, floor: Floor, simulate: Simulate) -> Standing:
    """Known numbers that were pulled before the law was in the plant, drawn back to their priors and let go again."""
    known = standing.known
    if not known.strained:
        return standing
    held = standing_of(confined(known, simulate, CLOSE, laws=standing.laws), standing.laws)
    left = detected(held, floor, known.experiment.fit).left
    again = resettled(held, floor, simulate, leaps=1 if left else 0)
    return again if again.known.cost < known.cost else standing


def detected(standing: Standing, floor: Floor, trials: Sequence[int]) -> Detection:
    """Detection on readings from which laws that are columns of the prediction are taken off."""
    known = standing.known
    experiment = known.experiment
    if standing.laws:
        corrected = tuple(
            replace(
                trial,
                measured=trial.measured
                - (standing.shown(k) - standing.predicted[trial.drive].values) * trial.valid[:, None],
            )
            for k, trial in enumerate(experiment.trials)
        )
        experiment = replace(experiment, trials=corrected)
    return detect(experiment, floor, standing.predicted, trials, known=known)


def searched(experiment: Experiment) -> bool:
    """Whether phases and tooth contact are searched for: along a measured motion there are none."""
    return experiment.drives[0].schedule is not None
