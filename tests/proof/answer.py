"""What a method says of one trial: the only thing of it that the score reads."""

from __future__ import annotations

from pathlib import Path

import msgspec

from proof.words import Family, Port, Verdict


class Part(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """An immutable part of an answer or a truth; an unknown key is an error."""


class Suspect(Part, frozen=True, kw_only=True):
    """A place and a physics.

    `axis` is a joint's name for torques, encoders and the controller, a link's for wrenches, masses and appendages, a
    stream's for clocks, and empty for base and transducer. `channels` are those that show it, strongest first; they
    are part of the place for the transducer alone.
    """

    port: Port
    axis: str = ""
    channels: tuple[str, ...] = ()
    family: Family


class Candidate(Suspect, frozen=True, kw_only=True):
    """A suspect with the probability that the method gives it."""

    probability: float | None = None


class Estimate(Part, frozen=True, kw_only=True):
    """A parameter with its interval of nominal 95 %."""

    name: str
    unit: str
    value: float
    low: float | None = None
    high: float | None = None


class Claim(Candidate, frozen=True, kw_only=True):
    """A find that the method stands for: in a trial without concealed effects it is a false one.

    `named` is False for a law that was measured and that no effect of the method's library fits; `law` is what the
    method itself calls it, of which nothing is scored.
    """

    named: bool = True
    law: str = ""
    parameters: tuple[Estimate, ...] = ()
    alternatives: tuple[Candidate, ...] = ()  # the next best, best first
    indistinguishable_from: tuple[Suspect, ...] = ()
    held_out_variance: float | None = None  # share that the law explains of what recordings held out show


class Moved(Part, frozen=True, kw_only=True):
    """A known parameter that had to move, and by how many of its prior's sigmas."""

    name: str
    value: float
    sigma: float
    sigmas: float


class HeldOut(Part, frozen=True, kw_only=True):
    """Whitened rms of the residual of recordings held out, over the repeatability floor's: 1 is the floor."""

    before: float
    after: float


class Answer(Part, frozen=True, kw_only=True):
    """A method's verdict on a trial.

    `detected`: there is a mismatch beyond the floor that the known parameters, within their uncertainties, do not
    explain; `log10_p` is the decimal logarithm of that test's p-value, None where a method has none.
    """

    method: str
    trial: str
    detected: bool
    log10_p: float | None = None
    verdict: Verdict
    moved: tuple[Moved, ...] = ()
    numbers: tuple[Moved, ...] = ()  # all known parameters as refitted; not kept with a score
    finds: tuple[Claim, ...] = ()
    held_out: HeldOut | None = None
    seconds: float
    failure: str = ""  # why there is no verdict: counted as no answer, never left out


def write(path: Path, answer: Answer) -> None:
    """Write an answer in one step, so that a file that exists is whole."""
    aside = path.with_name(f".{path.name}.part")
    aside.write_bytes(encode(answer))
    aside.replace(path)


def encode(answer: Answer) -> bytes:
    """Return an answer as it is written."""
    return msgspec.json.format(msgspec.json.encode(answer, order="deterministic"), indent=1) + b"\n"


def decode(content: bytes) -> Answer:
    """Return the answer in `content`; msgspec.ValidationError names what is wrong with it."""
    return msgspec.json.decode(content, type=Answer)
