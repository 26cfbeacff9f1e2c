"""What smoothing finds by itself, before the plant judges it."""

from __future__ import annotations

from pathlib import Path
from time import monotonic

from msgspec import structs

from kbs_process.campaign.load import load_campaign
from kbs_process.diagnosis.screening.suspects import Candidate
from kbs_process.diagnosis.smoothing.search import Fitted, Proposal, moved, search
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
    off = tuple(one for one in _moved(found.alone) if abs(one.sigmas) > OFF)
    finds = tuple(_claim(one) for one in found.proposals)
    return Answer(
        method=METHOD,
        trial=folder.name,
        detected=bool(finds),
        verdict="physics" if finds else "parameters off" if off else "none",
        moved=() if finds else off,
        numbers=_moved(found.beside),
        finds=finds,
        seconds=monotonic() - begin,
    )


def _moved(fitted: Fitted) -> tuple[Moved, ...]:
    numbers = [(one, one.sigmas) for one in moved(fitted)]
    return tuple(
        Moved(name=one.name, value=one.value, sigma=one.sigma, sigmas=by) for one, by in numbers if by is not None
    )


def _claim(one: Proposal) -> Claim:
    own = _suspect(one.candidate)
    following = [_suspect(other) for other in one.others[:NEXT]]
    return Claim(
        port=own.port,
        axis=own.axis,
        channels=own.channels,
        family=own.family,
        law=one.candidate.name,
        parameters=tuple(
            Estimate(name=e.name, unit=e.unit, value=e.value, low=e.low, high=e.high) for e in one.estimates
        ),
        alternatives=tuple(Claimed(**structs.asdict(other)) for other in following),
        indistinguishable_from=tuple(_suspect(other) for other in one.alike),
    )


def _suspect(candidate: Candidate) -> Suspect:
    law = candidate.effect
    channels = tuple(candidate.site.split(BY)) if law.port.of_channel else ()
    axis = "" if law.port.of_channel or law.port.beneath else candidate.site
    return Suspect(port=law.port_word, axis=axis, channels=channels, family=law.family)
