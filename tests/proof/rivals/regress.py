"""What regressions on a library share: scaled columns, energies by channel, claims out of chosen groups."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

import numpy as np

from proof.answer import Answer, Candidate, Claim
from proof.rivals.case import Array, Case, Recording, held_out, stacked
from proof.rivals.library import Term, library, matrix, suspect
from proof.words import Verdict

Group = tuple[str, str, str, str]


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """Residuals Y (n, c) and library columns X (n, terms), detrended, columns of unit rms."""

    case: Case
    terms: tuple[Term, ...]
    scale: Array  # (terms,)
    X: Array
    Y: Array
    block: Array  # (n,) which recording a row is of

    @classmethod
    def of(cls, case: Case, recordings: Sequence[Recording] | None = None) -> Problem:
        chosen = case.fitted if recordings is None else recordings
        terms = library(case)
        X = stacked(chosen, lambda recording: matrix(terms, recording))
        scale = np.sqrt(np.mean(X**2, axis=0))
        moving = scale > 1e-9 * np.max(scale)
        terms = tuple(term for term, moves in zip(terms, moving, strict=True) if moves)
        block = np.concatenate([np.full(int(r.valid.sum()), k) for k, r in enumerate(chosen)])
        return cls(
            case, terms, scale[moving], X[:, moving] / scale[moving], stacked(chosen, lambda r: r.residual), block
        )

    @property
    def groups(self) -> tuple[Group, ...]:
        return tuple(dict.fromkeys(term.group for term in self.terms))

    def columns(self, groups: Collection[Group]) -> list[int]:
        """Indices of the terms of some groups."""
        return [k for k, term in enumerate(self.terms) if term.group in groups]

    def predicted(self, coefficients: Array) -> Callable[[Recording], Array]:
        """What coefficients (terms, c) of the scaled columns say of a recording, (n, c)."""
        return lambda recording: matrix(self.terms, recording) / self.scale @ coefficients


def least_squares(X: Array, Y: Array) -> Array:
    """Coefficients (k, c), with a ridge of 1e-6 so that dependent columns share."""
    return np.linalg.solve(X.T @ X + 1e-6 * len(X) * np.eye(X.shape[1]), X.T @ Y)


def answer(method: str, problem: Problem, coefficients: Array, *, log10_p: float | None, seconds: float) -> Answer:
    """Turn coefficients (terms, c) into an answer: a claim for each group that has one, strongest first."""
    case = problem.case
    claims: list[tuple[float, Claim]] = []
    for group in problem.groups:
        columns = problem.columns([group])
        if not np.any(coefficients[columns]):
            continue
        explained = np.sum((problem.X[:, columns] @ coefficients[columns]) ** 2, axis=0)
        energy = dict(zip(case.channels, explained.tolist(), strict=True))
        found = suspect(problem.terms[columns[0]], energy)
        claim = Claim(port=found.port, axis=found.axis, channels=found.channels, family=found.family)
        claims.append((float(explained.sum()), claim))
    finds = merged(claims)
    verdict: Verdict = "physics" if finds else "parameters off" if case.moved else "none"
    return Answer(
        method=method,
        trial=case.trial,
        detected=bool(finds) if log10_p is None else log10_p < -3.0,
        log10_p=log10_p,
        verdict=verdict,
        moved=case.moved,
        finds=finds,
        held_out=held_out(case, problem.predicted(coefficients)),
        seconds=case.seconds + seconds,
    )


def merged(claims: Sequence[tuple[float, Claim]]) -> tuple[Claim, ...]:
    """Claims of one place and physics as one, by what they explain; what comes after a claim is its alternatives."""
    total: dict[tuple[str, str, str], tuple[float, Claim]] = {}
    for energy, claim in claims:
        key = (claim.port, claim.axis, claim.family)
        best = max(total.get(key, (0.0, claim)), (energy, claim), key=lambda entry: entry[0])[1]
        total[key] = (total.get(key, (0.0, claim))[0] + energy, best)
    ranked = sorted(total.values(), key=lambda entry: -entry[0])
    everything = sum(energy for energy, _ in ranked) or 1.0
    finds = []
    for place, (energy, claim) in enumerate(ranked):
        following = tuple(
            Candidate(port=c.port, axis=c.axis, channels=c.channels, family=c.family, probability=e / everything)
            for e, c in ranked[place + 1 : place + 3]
        )
        finds.append(
            Claim(
                port=claim.port, axis=claim.axis, channels=claim.channels, family=claim.family, named=claim.named,
                probability=energy / everything, alternatives=following, held_out_variance=claim.held_out_variance,
            )
        )  # fmt: skip
    return tuple(finds)
