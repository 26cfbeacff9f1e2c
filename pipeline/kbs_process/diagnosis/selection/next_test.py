r"""The test that tells apart what these recordings cannot: the trajectory with the greatest distance of the rivals.

On a trajectory that nobody has run, what the law that was found would add is

    r = S_A a_A,   rho_delta^2 = min_{b, theta} |r - S_B b - J theta|^2 + theta^T C^{-1} theta

in the metric of the floor: what a rival B with any amplitudes b, at any of its shapes, and the known parameters within
what the recordings left of their uncertainty C cannot take up. The least over the rivals counts. Where a find has no
rival, its least known combination of numbers does: the smallest eigenvalue of the information S_A^T S_A, known
parameters refitted, in units of the present standard deviations. Everything goes through the plant linearised along
each trajectory's own simulation.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import norm

from kbs_process.diagnosis.acceptance.outcome import Find
from kbs_process.diagnosis.experiments.experiment import Drive, Experiment, Trial
from kbs_process.diagnosis.experiments.floor import Floor
from kbs_process.diagnosis.experiments.hypothesis import Prediction, Simulate
from kbs_process.diagnosis.experiments.metric import metrics
from kbs_process.diagnosis.experiments.thresholds import RIVALS
from kbs_process.diagnosis.facts import Identity, Planned
from kbs_process.diagnosis.nominal.joint import Standing
from kbs_process.diagnosis.nominal.parameters import slopes
from kbs_process.diagnosis.proposing.tryout import identity
from kbs_process.diagnosis.proposing.view import suspects_of
from kbs_process.diagnosis.screening.gls import Background
from kbs_process.diagnosis.screening.scene import Scene
from kbs_process.diagnosis.screening.screen import Bench, Suspect
from kbs_process.diagnosis.selection.as_suspect import sigma_of, suspect_of
from kbs_process.diagnosis.selection.trajectories import Trajectory, family, limits_of
from kbs_process.signals.records import Array

_SECONDS = 200.0  # of a proposed test, or as long as the longest recording
_CLEAR_S = 3.0  # at either end of a recording that are not compared
_WEAK = 0.1  # error of a law over the law: what is less is known well enough
_JUDGED = 2  # trajectories on which the known parameters are refitted: each costs a simulation of every number
_FEW = 3  # rivals that are told from
_BATCH = 16  # suspects whose signatures are made together
_DEPENDENT = 1e-10

# What simulates an experiment, for as long as the context lasts.
Simulating = Callable[[Experiment], AbstractContextManager[Simulate]]


@dataclass(frozen=True, slots=True, eq=False)
class Proposal:
    """The next test, with what it will show."""

    law: Identity
    rivals: tuple[Identity, ...]  # that it is told from; empty: its numbers are measured better
    trajectory: Trajectory
    distance: float  # of the nearest rival in one recording, known parameters refitted; nan without rivals
    p_wrong: float  # with one recording
    recordings: int  # that are needed for P(wrong) < 1 %, or 1
    sigma: float  # of the least known combination of numbers over that of now, with one recording; nan with rivals
    tried: tuple[Planned, ...]  # best first


def propose(standing: Standing, finds: Sequence[Find], floor: Floor, simulating: Simulating) -> Proposal | None:
    """Return the next test for what is open after a diagnosis; None where nothing is, or commands drive nothing."""
    asked = _question(finds)
    if asked is None or any(drive.schedule is None for drive in standing.known.experiment.drives):
        return None
    find, rivals = asked
    experiment = standing.known.experiment
    limits = limits_of(experiment.drives, experiment.dt)
    trajectories = family(limits, experiment.rig.joint_names, min(_SECONDS, limits.seconds), find.identity.place.site)
    if not trajectories:
        return None
    planned = _planned(experiment, trajectories)
    with simulating(planned) as simulate:
        stage = _Stage.of(standing, planned, floor, find, simulate)
        if stage is None:
            return None
        worth = stage.worth(rivals)
        order = np.argsort(-worth, kind="stable")
        if not worth[order[0]] > 0.0:
            return None
        judged = {int(k): stage.judged(int(k), rivals, simulate) for k in order[:_JUDGED]}
        best = min(judged, key=lambda k: -judged[k][0] if rivals else judged[k][1])
        least, sigma = judged[best]
    tried = tuple(Planned(trajectories[k].words, float(worth[k])) for k in order)
    needed = int(np.ceil((RIVALS / least) ** 2)) if rivals and least > 0.0 else 1
    return Proposal(
        law=find.identity,
        rivals=tuple(rivals),
        trajectory=trajectories[best],
        distance=least,
        p_wrong=float(norm.sf(0.5 * least)) if rivals else float("nan"),
        recordings=max(1, needed),
        sigma=sigma,
        tried=tried,
    )


def _question(finds: Sequence[Find]) -> tuple[Find, list[Identity]] | None:
    """The first find that has rivals, of which none was found as well; else the one that is known worst, if badly."""
    found = {find.identity for find in finds}
    for find in finds:
        rivals = [one for one in find.indistinguishable_from if one not in found]
        if rivals:
            return find, rivals[:_FEW]
    weak = [find for find in finds if _unknown(find) > _WEAK]
    return (max(weak, key=_unknown), []) if weak else None


def _unknown(find: Find) -> float:
    """Error of a law as a whole over the law, rms along the recordings: each number adds one to rho^2 by chance."""
    count = sum(one.sigma > 0.0 for one in find.estimates)
    return float(np.sqrt(count) / find.rho_eff) if find.rho_eff > 0.0 else 0.0


def _planned(experiment: Experiment, trajectories: Sequence[Trajectory]) -> Experiment:
    """The experiment that consists of the family, one recording each, through the controller."""
    like = next(trial for trial in experiment.trials if trial.role != "held-out")
    drives, trials = [], []
    for number, one in enumerate(trajectories):
        n = int(one.seconds / experiment.dt)
        clear = round(_CLEAR_S / experiment.dt)
        valid = np.zeros(n, dtype=np.bool_)
        valid[clear : n - clear] = True
        drives.append(Drive(number, n, one.schedule, None, like.wrench_rate, like.angle_rate))
        trials.append(
            Trial(
                name=f"planned {number}",
                role="fit",
                trajectory=number,
                drive=number,
                measured=np.zeros((n, len(experiment.channels))),
                valid=valid,
                wrench_rate=like.wrench_rate,
                angle_rate=like.angle_rate,
                wrench_clock_sigma=like.wrench_clock_sigma,
                angle_clock_sigma=like.angle_clock_sigma,
                temperature=None,
            )
        )
    return replace(experiment, drives=tuple(drives), trials=tuple(trials))


def _as_predicted(planned: Experiment, predicted: Mapping[int, Prediction]) -> Experiment:
    """Planned recordings with what is to be expected of them: where a joint moves, its encoder shows something."""
    trials = [replace(trial, measured=predicted[trial.drive].values * trial.valid[:, None]) for trial in planned.trials]
    return replace(planned, trials=tuple(trials))


@dataclass(frozen=True, slots=True, eq=False)
class _Stage:
    """The family of trajectories with the found law on it."""

    standing: Standing  # of the planned recordings, which show the law
    bench: Bench
    columns: dict[int, Array]  # by trajectory, whitened signature of each of the law's amplitudes
    amplitude: Array
    sigma: Array  # of the amplitudes at present
    prior: Array  # (p, p), square root of the precision of the known parameters as the recordings left them
    free: tuple[int, ...]  # places of these among all free numbers

    @classmethod
    def of(cls, standing: Standing, planned: Experiment, floor: Floor, find: Find, simulate: Simulate) -> _Stage | None:
        known, hypothesis = standing.known, standing.hypothesis
        drives = range(len(planned.drives))
        predicted = dict(zip(drives, simulate([(drive, hypothesis) for drive in drives]), strict=True))
        if not all(np.isfinite(one.values).all() for one in predicted.values()):
            return None
        planned = _as_predicted(planned, predicted)
        metric = metrics(planned, replace(floor, experiment=planned), predicted, hypothesis)
        scene = Scene.of(planned, hypothesis, predicted)
        found = suspect_of(find, scene)
        if found is None:
            return None
        suspect, amplitude = found
        empty = {k: np.zeros(0) for k in drives}
        background = Background.of(empty, {k: np.zeros((0, 0)) for k in drives}, np.zeros(0))
        bare = replace(known, experiment=planned, metric=metric, slopes={}, shown={}, residual=tuple(empty.values()))
        bench = Bench(bare, scene, background, ())
        columns = {k: metric[k](bench.signatures([suspect], k)) for k in drives}
        # The planned recordings show the law: what proposes shapes of rivals looks at that.
        shown = replace(bare, residual=tuple(columns[k] @ amplitude for k in drives))
        own = set(hypothesis.rig.quantities())
        laws = {f"{one.name}" for one in find.estimates}
        free = tuple(
            k
            for k, scalar in enumerate(known.free)
            if scalar.quantity in own
            and scalar.quantity.rpartition(".")[2] not in laws
            and not scalar.quantity.startswith(f"external.{find.identity.law}")
        )
        C = known.covariance[np.ix_(free, free)]
        if not np.isfinite(C).all():
            return None
        size = np.sqrt(np.where(np.diag(C) > 0.0, np.diag(C), 1.0))  # numbers of any units
        values, vectors = np.linalg.eigh(np.linalg.pinv(C / np.outer(size, size), hermitian=True))
        prior = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T / size
        return cls(
            Standing(shown, predicted, {}),
            replace(bench, known=shown),
            columns,
            amplitude,
            sigma_of(find, suspect, amplitude),
            prior,
            free,
        )

    def worth(self, rivals: Sequence[Identity]) -> Array:
        """(trajectories,) distance of the nearest rival, or what is learnt, the known parameters as they stand."""
        shapes = self._shapes(rivals)
        none = {k: np.zeros((len(x), 0)) for k, x in self.columns.items()}
        if not rivals:
            return np.array([self._learnt(k, none[k]) for k in sorted(self.columns)])
        return np.array([self._nearest(k, shapes, none[k]) for k in sorted(self.columns)])

    def judged(self, k: int, rivals: Sequence[Identity], simulate: Simulate) -> tuple[float, float]:
        """Distance, and standard deviation over that of now, on a trajectory with the known parameters refitted."""
        known = self.bench.known
        chosen = [known.free[index] for index in self.free]
        spread = known.sigma[list(self.free)]
        made = slopes(known.experiment, self.standing.hypothesis, chosen, spread, [k], simulate)[k]
        # A number by whose error the plant would not run is held.
        J = np.nan_to_num(known.metric[k](np.moveaxis(made.columns, 0, 2)))
        if rivals:
            return self._nearest(k, self._shapes(rivals), J), float("nan")
        return float("nan"), float(1.0 / np.sqrt(1.0 + self._learnt(k, J) ** 2))

    def _shapes(self, rivals: Sequence[Identity]) -> list[Suspect]:
        """The rivals at every shape that the trajectories give them."""
        if not rivals:
            return []
        every = suspects_of(self.standing, self.bench.scene)
        return [one for one in every if identity(one) in rivals and not one.each_trial]

    def _nearest(self, k: int, shapes: Sequence[Suspect], J: Array) -> float:
        """Distance of the nearest rival; one that has no shape here is told by all that the law shows."""
        shown = self.columns[k] @ self.amplitude
        found = [float(np.linalg.norm(shown))]
        for first in range(0, len(shapes), _BATCH):
            batch = shapes[first : first + _BATCH]
            columns = self.bench.known.metric[k](self.bench.signatures(batch, k))
            ends = np.cumsum([len(one.amplitudes) for one in batch])
            found += [self._apart(shown, own, J) for own in np.split(columns, ends[:-1], axis=1)]
        return min(found)

    def _apart(self, shown: Array, other: Array, J: Array) -> float:
        """Length of what neither a rival nor known parameters within their covariance take up."""
        tail = np.zeros((J.shape[1], other.shape[1] + J.shape[1]))
        if J.shape[1]:
            tail[:, other.shape[1] :] = self.prior
        A = np.vstack([np.hstack([other, J]), tail])
        if not np.isfinite(A).all():  # a shape that no linear plant bears
            return float("inf")
        length = np.linalg.norm(A, axis=0)
        A = A[:, length > 0.0] / length[length > 0.0]
        y = np.concatenate([shown, np.zeros(len(tail))])
        return float(np.linalg.norm(y - A @ np.linalg.lstsq(A, y, rcond=_DEPENDENT)[0]))

    def _learnt(self, k: int, J: Array) -> float:
        """Root of the smallest eigenvalue of the law's information in units of its present standard deviations."""
        x = self.columns[k]
        H = x.T @ x
        if J.shape[1]:
            H = H - x.T @ J @ np.linalg.solve(J.T @ J + self.prior.T @ self.prior, J.T @ x)
        known = self.sigma > 0.0
        scaled = (H * np.outer(self.sigma, self.sigma))[np.ix_(known, known)]
        return float(np.sqrt(max(0.0, np.linalg.eigvalsh(scaled)[0]))) if known.any() else 0.0
