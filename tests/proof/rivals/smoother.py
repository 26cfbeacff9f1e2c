"""What smoothing finds by itself, before the plant judges it."""

from __future__ import annotations

from pathlib import Path
from time import monotonic

import numpy as np
from msgspec import structs

from kbs_process.campaign.load import load_campaign
from kbs_process.diagnosis.screening.suspects import Candidate
from kbs_process.diagnosis.smoothing.fit import Fitted
from kbs_process.diagnosis.smoothing.screen import Screen
from kbs_process.diagnosis.smoothing.search import Proposal, Smoothed, search
from kbs_process.plant.sensing import BY
from kbs_process.progress import SilentProgress
from kbs_process.studies.diagnose.reading import experiment_of
from proof.answer import Answer, Claim, Estimate, Moved, Suspect
from proof.answer import Candidate as Claimed

METHOD = "smoother"
NEXT = 2  # alternatives that are named
OFF = 4.0  # sigmas


def solve(folder: Path) -> Answer:
    """Answer a trial."""
    begin = monotonic()
    found = search(experiment_of(load_campaign(folder, checksums=False), SilentProgress()))
    off = tuple(one for one in moved(found.alone) if abs(one.sigmas) > OFF)
    finds = tuple(map(_claim, found.proposals, _estimates(found)))
    return Answer(
        method=METHOD,
        trial=folder.name,
        detected=bool(finds),
        verdict="physics" if finds else "parameters off" if off else "none",
        moved=() if finds else off,
        numbers=moved(found.beside),
        finds=finds,
        seconds=monotonic() - begin,
    )


def moved(fitted: Fitted) -> tuple[Moved, ...]:
    """Numbers of the rig, as fitted."""
    problem, state, at = fitted.problem, fitted.state, fitted.problem.of_rig
    sigma = np.sqrt(np.diag(fitted.covariance))[at]
    off = ((state.x - problem.prior) / problem.spread)[at]
    return tuple(
        Moved(name=name, value=float(value), sigma=float(known), sigmas=float(by))
        for name, value, known, by in zip(problem.elements.names, state.x[at], sigma, off, strict=True)
    )


def _estimates(found: Smoothed) -> list[tuple[Estimate, ...]]:
    """Numbers of each effect as all together have them."""
    problem, state = found.beside.problem, found.beside.state
    if not problem.found:
        return []
    screen, ends = Screen(problem, state), np.cumsum([len(one.amplitudes) for one in problem.present])
    places = np.split(np.stack(problem.amplitudes), ends[:-1], axis=1)[len(problem.given) :]
    return [
        tuple(
            Estimate(name=e.name, unit=e.unit, value=e.value, low=e.low, high=e.high)
            for e in screen.estimated(candidate, own)
        )
        for candidate, own in zip(problem.found, places, strict=True)
    ]


def _claim(one: Proposal, estimates: tuple[Estimate, ...]) -> Claim:
    own = _suspect(one.candidate)
    following = [_suspect(other) for other in one.others[:NEXT]]
    return Claim(
        port=own.port,
        axis=own.axis,
        channels=own.channels,
        family=own.family,
        law=one.candidate.name,
        parameters=estimates,
        alternatives=tuple(Claimed(**structs.asdict(other)) for other in following),
        indistinguishable_from=tuple(_suspect(other) for other in one.alike),
    )


def _suspect(candidate: Candidate) -> Suspect:
    law = candidate.effect
    channels = tuple(candidate.site.split(BY)) if law.port.of_channel else ()
    axis = "" if law.port.of_channel or law.port.beneath else candidate.site
    return Suspect(port=law.port_word, axis=axis, channels=channels, family=law.family)
