"""The table of cases as cases.toml holds it: what is concealed, what is odd, and which answers are right or wrong."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import msgspec

_TABLE = Path(__file__).with_name("cases.toml")


class _Part(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A part of the table: a key that is none of these is an error."""


class Concealed(_Part, frozen=True, kw_only=True):
    """One effect. Its strength was worked out once (`proof.concealed.bench`), over the runs to fit of this campaign."""

    physics: str
    place: str
    amplitude: float
    shapes: tuple[float, ...]
    rho: float
    kappa: float
    rho_eff: float


class Moved(_Part, frozen=True, kw_only=True):
    """One element of a known parameter that is off, in sigmas that the campaign states."""

    name: str
    element: int = 0
    sigmas: float


class Case(_Part, frozen=True, kw_only=True):
    """One campaign. What is left out of the table is as in any other trial."""

    number: str
    name: str  # of its folder: says nothing
    seed: int
    title: str
    done: str  # what is odd in its recordings or in its description
    right: tuple[str, ...]  # answers that are right, or honestly undecided
    wrong: tuple[str, ...]

    effects: tuple[Concealed, ...] = ()
    rho_eff: float = 0.0  # of several effects together
    moved: tuple[Moved, ...] = ()  # all other numbers then are nearly what the files say

    loop: Literal["", "open", "closed"] = ""  # "": drawn
    trajectories: int = 3
    runs: tuple[tuple[int, str, int], ...] = ()  # path (-1: calibration), role, repeat; none: as any trial's
    azimuth_rests: bool = False
    long_h: float = 0.0  # length of TRACK2 in place of what is drawn
    rate_hz: float = 0.0  # of transducer and encoders; 0: drawn
    noise: float = 1.0  # factor on the transducer's noise, stated and real
    stamp_jitter: float | None = None  # s
    bounds: tuple[float, ...] = ()  # N m: beyond it, Tz stays where it is; one for each trajectory
    encoder: Literal["recorded", "command in its place", "left out"] = "recorded"


class _Table(_Part, frozen=True, kw_only=True):
    case: tuple[Case, ...]


CASES = msgspec.toml.decode(_TABLE.read_bytes(), type=_Table).case
BY_NUMBER = {case.number: case for case in CASES}
