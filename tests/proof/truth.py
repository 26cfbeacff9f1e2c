"""What is true of a trial, as its seal holds it."""

from __future__ import annotations

import math

import msgspec

from proof.answer import Part, Suspect
from proof.words import Kind, Split


class TrueParameter(Part, frozen=True, kw_only=True):
    """A parameter's true value; `sigma_cr` is the least standard deviation that any method can reach.

    None where the concealed equation has no such parameter to be compared with.
    """

    name: str
    unit: str
    value: float
    sigma_cr: float | None = None


class Concealed(Suspect, frozen=True, kw_only=True):
    """One concealed effect.

    `rho` is its distance from the floor in the whitened metric, `kappa` the share of it that known parameters absorb,
    `rho_eff` what is left. `equivalents` are suspects that these recordings cannot tell from it; None: not worked out.
    """

    name: str
    catalogued: bool = True
    rho: float
    kappa: float = 0.0
    rho_eff: float
    parameters: tuple[TrueParameter, ...] = ()
    equivalents: tuple[Suspect, ...] | None = None


class Beyond(Part, frozen=True, kw_only=True):
    """A known parameter that was drawn beyond its uncertainty."""

    name: str
    sigmas: float


class Truth(Part, frozen=True, kw_only=True):
    """What was concealed in a trial; `level` is the nominal strength, 0 for trials without an effect."""

    trial: str
    kind: Kind
    split: Split
    level: float = 0.0
    effects: tuple[Concealed, ...] = ()
    beyond: tuple[Beyond, ...] = ()
    rho_eff: float = 0.0  # of all effects together
    laboratory: dict[str, float] | None = None  # how much acts at random: engine.laboratory

    def __post_init__(self) -> None:
        if (self.kind == "concealed") != bool(self.effects):
            raise ValueError(f"{self.trial}: kind '{self.kind}' with {len(self.effects)} effects")
        if not math.isfinite(self.rho_eff):
            raise ValueError(f"{self.trial}: rho_eff is {self.rho_eff}")


def encode(truth: Truth) -> bytes:
    """Return a truth as it is sealed."""
    return msgspec.json.encode(truth, order="deterministic")


def decode(content: bytes) -> Truth:
    """Return the truth in `content`."""
    return msgspec.json.decode(content, type=Truth)
