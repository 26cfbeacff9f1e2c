"""The diagnosis' results.json in the words of the bench."""

from __future__ import annotations

import math
from collections.abc import Iterable

import msgspec

from kbs_process.errors import OutputError
from kbs_process.results.records import decode
from kbs_process.studies.diagnose.results import DiagnosisResults, Find, Fitted, Place, Rival
from proof.answer import Answer, Candidate, Claim, Estimate, HeldOut, Moved, Suspect
from proof.words import OURS

_OFF = 4.0  # sigmas by which a known parameter has to move to be called off
_DISTANCE = 4.65  # of two laws' predictions, below which one in a hundred decisions would be wrong
_FORMULA = 0.08  # of a find's distance, by which its formula may be from nature's
_WITHOUT_AXIS = ("transducer", "base")


def answer_of(content: bytes, trial: str, seconds: float) -> Answer:
    """Translate a diagnosis; raises ValueError if it is no diagnosis or speaks of what the bench has no word for."""
    try:
        said = decode(content, DiagnosisResults)
        return _answer(said, trial, seconds)
    except (OutputError, msgspec.ValidationError) as error:
        raise ValueError(f"results.json: {error}") from error


def _answer(said: DiagnosisResults, trial: str, seconds: float) -> Answer:
    numbers = tuple(
        Moved(name=entry.name, value=entry.value, sigma=entry.sigma, sigmas=entry.sigmas)
        for entry in said.moved
        if entry.sigmas is not None
    )
    given = Answer(
        method=OURS,
        trial=trial,
        detected=said.answer in ("physics", "undecided"),
        log10_p=said.log10_p,
        verdict=said.answer,
        moved=tuple(one for one in numbers if abs(one.sigmas) > _OFF),
        numbers=numbers,
        finds=tuple(_claim(find) for find in said.finds) or _place(said),
        held_out=_held_out(said),
        seconds=seconds,
    )
    # Records are not checked when they are made, only when they are read.
    return msgspec.convert(msgspec.to_builtins(given), Answer)


def _claim(find: Find) -> Claim:
    rivals = sorted(find.rivals, key=lambda rival: -rival.probability)
    near = max(_DISTANCE, _FORMULA * find.distance)
    alike = [
        rival
        for rival in rivals
        if rival.distance is not None and rival.distance < (near if rival.simulated else _DISTANCE)
    ]
    return Claim(
        **_suspect(find.place, find.family if find.named else "unnamed"),
        named=find.named,
        law=find.name,
        probability=find.probability,
        parameters=tuple(_estimate(entry) for entry in find.parameters),
        alternatives=tuple(
            Candidate(**_suspect(rival.place, rival.family), probability=rival.probability) for rival in rivals
        ),
        indistinguishable_from=tuple(Suspect(**_of(rival)) for rival in alike),
        held_out_variance=find.held_out_variance,
    )


def _place(said: DiagnosisResults) -> tuple[Claim, ...]:
    """The claim of a diagnosis that knows where it enters, and no law: ports that look the same are named with it."""
    places = [Suspect(**_suspect(place, "unnamed")) for place in said.located]
    if not places:
        return ()
    told = msgspec.structs.asdict(places[0])
    alike = tuple(Candidate(**msgspec.structs.asdict(place)) for place in places[1:])
    return (Claim(**told, named=False, alternatives=alike, indistinguishable_from=tuple(places[1:])),)


def _of(rival: Rival) -> dict[str, str | tuple[str, ...]]:
    return _suspect(rival.place, rival.family)


def _suspect(place: Place, family: str) -> dict[str, str | tuple[str, ...]]:
    axis = "" if place.port in _WITHOUT_AXIS else place.site
    channels = place.channels
    if place.port == "transducer" and not channels:
        channels = (place.site.partition("<-")[0],)
    return {"port": place.port, "axis": axis, "channels": channels, "family": family}


def _estimate(entry: Fitted) -> Estimate:
    return Estimate(name=entry.name, unit=entry.unit, value=entry.value, low=entry.low, high=entry.high)


def _held_out(said: DiagnosisResults) -> HeldOut | None:
    """Residuals of recordings held out, with known parameters refitted and with all finds; recordings count alike."""
    trials = [trial for trial in said.trials if trial.role == "held-out"]
    if not trials:
        return None
    return HeldOut(before=_rms(t.known for t in trials), after=_rms(t.corrected for t in trials))


def _rms(values: Iterable[float]) -> float:
    squares = [value**2 for value in values]
    return math.sqrt(sum(squares) / len(squares))
