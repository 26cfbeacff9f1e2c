"""Every suspect, seen from what is believed at a time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from kbs_process.diagnosis.experiments.thresholds import MOSTLY_DONE, ORDERED
from kbs_process.diagnosis.nominal.joint import Standing
from kbs_process.diagnosis.proposing.curves import curves
from kbs_process.diagnosis.proposing.proposals import proposed
from kbs_process.diagnosis.screening.ranges import swept
from kbs_process.diagnosis.screening.scene import Scene
from kbs_process.diagnosis.screening.screen import Bench, Catalogued, Found, Screening, Suspect, screen
from kbs_process.diagnosis.screening.suspects import Candidate, candidates


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """Where a screen looks from: what is believed, and every suspect along it."""

    standing: Standing
    bench: Bench
    scene: Scene
    suspects: tuple[Suspect, ...]
    screening: Screening

    @classmethod
    def of(cls, standing: Standing, among: Callable[[Suspect], bool] = lambda _: True, *, linear: bool = True) -> View:
        """Of all suspects, or of those for which `among` is true; none of the plant's, if it is not made `linear`."""
        scene = _scene(standing, linear=linear)
        return cls._seen(standing, scene, [one for one in suspects_of(standing, scene) if among(one)])

    @classmethod
    def at(cls, standing: Standing, candidates: Sequence[Candidate]) -> View:
        """Of candidates whose shapes are known already."""
        scene = _scene(standing, linear=True)
        return cls._seen(standing, scene, [Catalogued(candidate, scene) for candidate in candidates])

    @classmethod
    def _seen(cls, standing: Standing, scene: Scene, suspects: Sequence[Suspect]) -> View:
        bench = Bench.of(standing.known, scene)
        return cls(standing, bench, scene, tuple(suspects), screen(bench, suspects))

    @property
    def able(self) -> list[Found]:
        """Suspects that may lead, best first.

        A law that repeats predicts what was not recorded; one whose size and phase are each recording's own does not.
        It leads only where none that repeats does half of what it does.
        """
        able = self._shown
        repeating = [found for found in able if not found.suspect.each_trial]
        if repeating and 2.0 * repeating[0].score.gain >= able[0].score.gain:
            return repeating
        return able

    @property
    def unrepeated(self) -> list[Found]:
        """Suspects that do not lead because one that repeats does half of what they do, best first."""
        return [found for found in self._shown if found.suspect.each_trial and found not in self.able]

    @property
    def _shown(self) -> list[Found]:
        return [found for found in self.screening.candidates if found.significant and not found.absorbed]

    @property
    def ordered(self) -> bool:
        """Whether the best does enough of what there is to do for the order of the others to count.

        Where it does not, the plant is far from linear, or known numbers have taken up what was left out. Where much is
        left, they have been pulled, and a law that stands in for another does much, too: it has to be nearly all.
        """
        able, known = self.able, self.standing.known
        share = MOSTLY_DONE if known.gross else ORDERED
        return bool(able and able[0].score.gain >= share * known.excess)


def _scene(standing: Standing, *, linear: bool) -> Scene:
    return Scene.of(standing.known.experiment, standing.hypothesis, standing.predicted, linear=linear)


def suspects_of(standing: Standing, scene: Scene) -> list[Suspect]:
    """The catalogue at every site with every shape, then curves that no law of it has."""
    experiment, rig = scene.experiment, standing.hypothesis.rig
    ranges = swept(
        scene,
        proposed=proposed(standing.known, scene),
        temperature=all(trial.temperature is not None for trial in experiment.trials),
    )
    columns = next((signals.columns for signals in scene.signals.values()), ())
    recorded = any(one.schedule is not None and one.schedule.field is not None for one in experiment.drives)
    chosen = candidates(
        rig,
        experiment.effects,
        ranges,
        columns,
        experiment.channels,
        accepted=standing.hypothesis.effects,
        field_recorded=recorded,
    )
    return [*(Catalogued(candidate, scene) for candidate in chosen), *curves(scene)]
