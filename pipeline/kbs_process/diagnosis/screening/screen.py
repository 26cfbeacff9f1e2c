"""Every suspect along the linearised plant: what its best amplitudes would do for the residuals.

Signatures are made in batches, side by side, whitened, and reduced at once to sums of products (`gls`), so that
hundreds of candidates need the memory of a batch for each processor. Shapes are searched on their grids; amplitudes are
linear. Recordings that are whitened alike share one pass.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Protocol

import numpy as np
from scipy.special import logsumexp

from kbs_process.diagnosis.experiments.hypothesis import coupled
from kbs_process.diagnosis.experiments.jumps import PLACES, jump
from kbs_process.diagnosis.experiments.stamps import late_by
from kbs_process.diagnosis.experiments.thresholds import ABSORBED, FALSE_ALARM, LEAST_RHO
from kbs_process.diagnosis.nominal.known import Known
from kbs_process.diagnosis.screening import direct
from kbs_process.diagnosis.screening.gls import Background, Score, Sums, absorbing, per_trial, score
from kbs_process.diagnosis.screening.inlets import Inlet
from kbs_process.diagnosis.screening.scene import Scene
from kbs_process.diagnosis.screening.signature import inputs, reduced, sensed, stamped, unit_values
from kbs_process.diagnosis.screening.suspects import Candidate
from kbs_process.diagnosis.screening.transfer import BATCH, respond
from kbs_process.diagnosis.side_by_side import side_by_side
from kbs_process.estimation.tails import log_tail
from kbs_process.signals.records import WRENCH_CHANNELS, Array

_RUNAWAY = 1e30  # of a unit amplitude's signature


class Suspect(Protocol):
    """A candidate at one point of its shape's grid."""

    @property
    def family(self) -> tuple[str, str]:
        """Name and site; candidates that share it differ by their shape alone."""

    @property
    def amplitudes(self) -> tuple[str, ...]: ...

    @property
    def each_trial(self) -> bool:
        """Whether size and phase belong to a recording."""

    @property
    def places(self) -> int:
        """Among how many its place along each trajectory was looked for; 1 where all have one shape."""

    def inputs(self, drive: int) -> Sequence[Mapping[Inlet, Array]] | None:
        """For each amplitude what enters where, means over the path's steps; None where nothing goes through."""

    def outputs(self, drive: int) -> Array:
        """(n, c, amplitudes) change of the prediction, of what does not go through the plant."""


@dataclass(frozen=True, slots=True, eq=False)
class Catalogued:
    """A suspect of the catalogue at one point of its shape's grid."""

    candidate: Candidate
    scene: Scene
    size: float = 0.0  # of a clock's lone amplitude, at which what it does is exact; 0: to first order

    @property
    def family(self) -> tuple[str, str]:
        return self.candidate.name, self.candidate.site

    @property
    def amplitudes(self) -> tuple[str, ...]:
        return tuple(entry.name for entry in self.candidate.amplitudes)

    @property
    def each_trial(self) -> bool:
        return self.candidate.effect.each_trial

    @property
    def places(self) -> int:
        return PLACES if self.jumps else 1

    def inputs(self, drive: int) -> Sequence[Mapping[Inlet, Array]] | None:
        if not self.candidate.effect.in_plant:
            return None
        scene, hypothesis = self.scene, self.scene.hypothesis
        tapped, ways = scene.signals[drive], scene.courses[drive]
        return [
            scene.stepped(drive, column)
            for action in self.candidate.actions
            for column in inputs(action, tapped, hypothesis.rig, hypothesis.effects, ways.get(action.site))
        ]

    def outputs(self, drive: int) -> Array:
        experiment, rig = self.scene.experiment, self.scene.hypothesis.rig
        prediction = self.scene.predicted[drive].values
        law, tapped = self.candidate.effect, self.scene.signals[drive]
        if law.whole_band and tapped.readings is not None:
            return reduced(self.candidate, tapped, experiment.channels, rig, experiment.dt, len(prediction))
        if self.size:
            late = self.size * self.late(drive)[:, 0]
            change = np.zeros((*prediction.shape, 1))
            own = stamped(self.candidate.site, experiment.channels, rig)
            change[:, own, 0] = late_by(prediction[:, own], experiment.dt, late) / self.size
            return change
        t, known = self._recorded(drive)
        return sensed(self.candidate, t, prediction, experiment.channels, rig, known)

    @property
    def jumps(self) -> bool:
        """Whether it is the jump of a clock, at a time that each trajectory has."""
        return self.candidate.effect.jumps

    @property
    def of_clock(self) -> bool:
        return self.candidate.port.site == "stream"

    @property
    def of_every_clock(self) -> bool:
        """Whether it is the error of a clock, the same in all recordings."""
        return self.of_clock and not self.each_trial

    def late(self, drive: int) -> Array:
        """(n, amplitudes) by how many s stamps are late, for a unit of each amplitude of a clock's law."""
        return unit_values(self.candidate, *self._recorded(drive))

    def _recorded(self, drive: int) -> tuple[Array, dict[str, Array | float]]:
        """Time and what else is known of a drive's recordings that an equation may ask for."""
        experiment = self.scene.experiment
        t = np.asarray(np.arange(experiment.drives[drive].n) * experiment.dt, dtype=np.float64)
        own = [one for one in experiment.trials if one.drive == drive]
        first = min(own, key=lambda one: one.role == "held-out")  # the first that is fitted
        known: dict[str, Array | float] = {}
        if first.temperature is not None:
            known["temperature"] = first.temperature
        if self.jumps:
            known["drop_time"] = jump(experiment, self.scene.predicted, first.trajectory, self.candidate.site)
        return t, known


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """A suspect at the best point of its shape's grid, with what the screen says of it."""

    suspect: Suspect
    score: Score
    log_evidence: float  # over no effect, natural logarithm; mean over the grid, penalised for its amplitudes
    log_p: float  # of the best gain among all that were looked at, without any effect (Bonferroni)
    grid: int  # points of the shape that were tried
    absorbed_by: tuple[str, ...]  # known parameters, where kappa is beyond the bound

    @property
    def absorbed(self) -> bool:
        """Whether it would do something, and nothing that known parameters do not do as well."""
        score = self.score
        if score.kappa <= ABSORBED or score.whole_gain < LEAST_RHO**2:
            return False
        own, whole = log_tail(score.gain, score.rank), log_tail(score.whole_gain, score.whole_rank)
        return bool(own + np.log(self.grid) > np.log(FALSE_ALARM) > whole + np.log(self.grid))

    @property
    def significant(self) -> bool:
        return bool(self.log_p < np.log(FALSE_ALARM) and self.score.rho_eff > LEAST_RHO)

    def told_as(self, suspect: Suspect, score: Score, rows: int) -> Found:
        """The same as another suspect of its family, which does what `score` says."""
        more = evidence(score, rows) - evidence(self.score, rows)
        return replace(self, suspect=suspect, score=score, log_evidence=self.log_evidence + more)


@dataclass(frozen=True, slots=True, eq=False)
class Screening:
    """Suspects at their best shapes, most probable first."""

    candidates: tuple[Found, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Bench:
    """What candidates are measured against: the fit trials' residuals behind the known parameters."""

    known: Known
    scene: Scene
    background: Background
    alike: tuple[tuple[int, ...], ...]  # trials that are whitened alike

    @classmethod
    def of(cls, known: Known, scene: Scene, trials: Sequence[int] | None = None) -> Bench:
        """Over `trials`, else all that may be fitted."""
        members = tuple(known.experiment.fit if trials is None else trials)
        J = dict(zip(members, side_by_side(known.jacobian, members), strict=True))
        residual = {k: known.residual[k] for k in members}
        background = Background.of(residual, J, known.precision, known.offset, known.room)
        groups: dict[tuple[object, ...], list[int]] = {}
        for k in members:
            trial = known.experiment.trials[k]
            window = known.metric[k].whiten.window
            key = (trial.drive, window.tobytes(), trial.wrench_clock_sigma, trial.angle_clock_sigma)
            groups.setdefault(key, []).append(k)
        return cls(known, scene, background, tuple(tuple(group) for group in groups.values()))

    def columns(self, suspects: Sequence[Suspect]) -> dict[int, Array]:
        """Whitened signatures of all amplitudes of some suspects, side by side: by trial, (rows, m)."""
        experiment = self.known.experiment
        drives = {experiment.reference(experiment.trials[group[0]].trajectory) for group in self.alike}
        plain = {drive: self.signatures(suspects, drive) for drive in drives}
        found: dict[int, Array] = {}
        for group in self.alike:
            reference = experiment.reference(experiment.trials[group[0]].trajectory)
            whitened = self.known.metric[group[0]](plain[reference])
            found |= dict.fromkeys(group, whitened)
        return found

    def signatures(self, suspects: Sequence[Suspect], drive: int) -> Array:
        """(n, c, m) change of the prediction by a unit of each amplitude of some suspects."""
        experiment = self.known.experiment
        through = [suspect.inputs(drive) for suspect in suspects]
        driven = [column for columns in through if columns is not None for column in columns]
        parts: list[Array] = []
        n = experiment.drives[drive].n
        if driven:
            moved = iter(np.moveaxis(self._driven(driven, drive, n), 2, 0))
        for suspect, columns in zip(suspects, through, strict=True):
            if columns is None:
                parts.append(suspect.outputs(drive))
            else:
                parts.append(np.stack([next(moved) for _ in columns], axis=2))
        shown = np.concatenate(parts, axis=2)
        # What runs away along the linear plant, or has no value on this motion, says nothing.
        bounded = np.max(np.abs(shown), axis=(0, 1), initial=0.0) < _RUNAWAY
        return np.where(bounded, shown, 0.0)

    def _driven(self, columns: Sequence[Mapping[Inlet, Array]], drive: int, n: int) -> Array:
        """(n, c, m) change of the prediction by inputs of the plant, or of a rig that its motion drives."""
        experiment, rig = self.known.experiment, self.scene.hypothesis.rig
        path = self.scene.paths.get(drive)
        if path is None:
            motion = experiment.drives[drive].motion
            assert motion is not None
            whole = direct.respond(rig, columns, motion.q[:n])
            rows = rig.loads.index(rig.channels[experiment.wrench_channels :])
        else:
            whole = respond(path, columns, WRENCH_CHANNELS, round(path.rate * experiment.dt), n)
            rows = [6 + path.joints.index(name) for name in experiment.channels[experiment.loads :]]
        read = coupled(experiment.rig, experiment, np.eye(6)).T
        wrench = np.einsum("cw,nwm->ncm", read, whole[:, :6])
        return np.concatenate([wrench, whole[:, rows]], axis=1)


_Scored = tuple[Suspect, Score, tuple[str, ...]]  # with the known parameters that absorb it, if any do


def screen(bench: Bench, suspects: Sequence[Suspect]) -> Screening:
    """Rank suspects; see `Found`."""
    scores: dict[tuple[str, str], list[_Scored]] = {}
    for batch in side_by_side(partial(_scored, bench), _batches(suspects)):
        for one in batch:
            scores.setdefault(one[0].family, []).append(one)
    looked_at = sum(len(grid) for grid in scores.values())
    rows = bench.background.rows
    experiment = bench.known.experiment
    trajectories = len({experiment.trials[k].trajectory for k in bench.background.z})
    candidates = []
    for grid in scores.values():
        best = max(grid, key=lambda entry: evidence(entry[1], rows))
        mean = float(logsumexp([evidence(entry[1], rows) for entry in grid]) - np.log(len(grid)))
        lowest = min(entry[1].log_p for entry in grid)
        places = trajectories * np.log(best[0].places)
        log_p = min(0.0, lowest + np.log(looked_at) + places)
        candidates.append(Found(best[0], best[1], mean - places, log_p, len(grid), best[2]))
    candidates.sort(key=lambda candidate: -candidate.log_evidence)
    return Screening(tuple(candidates))


def _scored(bench: Bench, batch: Sequence[Suspect]) -> list[_Scored]:
    columns = bench.columns(batch)
    sums = Sums.over(bench.background, columns)
    found: list[_Scored] = []
    begin = 0
    for suspect in batch:
        own = np.arange(begin, begin + len(suspect.amplitudes))
        begin += len(own)
        mine = (
            per_trial(bench.background, {k: x[:, own] for k, x in columns.items()})
            if suspect.each_trial
            else sums.pick(own)
        )
        one = score(bench.background, mine)
        taken: tuple[str, ...] = ()
        if one.kappa > ABSORBED:
            taken = absorbing(bench.background, mine, one.whole, bench.known.names)
        found.append((suspect, one, taken))
    return found


def evidence(found: Score, rows: int) -> float:
    """Schwarz's approximation to the logarithm of the Bayes factor against no effect (Ann. Stat. 6:461, 1978)."""
    return float(0.5 * found.gain - 0.5 * found.rank * np.log(rows))


def _batches(suspects: Sequence[Suspect]) -> Iterator[list[Suspect]]:
    batch: list[Suspect] = []
    count = 0
    for suspect in suspects:
        if batch and count + len(suspect.amplitudes) > 2 * BATCH:
            yield batch
            batch, count = [], 0
        batch.append(suspect)
        count += len(suspect.amplitudes)
    if batch:
        yield batch
