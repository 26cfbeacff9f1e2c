"""Which claim speaks of which concealed effect, and what of it is right."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from proof.answer import Answer, Claim, Estimate, Suspect
from proof.truth import Concealed, TrueParameter

TOP = 3


@dataclass(frozen=True, slots=True)
class Judged:
    """What an answer says of one concealed effect."""

    effect: Concealed
    claim: Claim | None

    @property
    def port(self) -> bool:
        return self.claim is not None and self.claim.port == self.effect.port

    @property
    def place(self) -> bool:
        """Port and axis right, and at the transducer the channel that shows most."""
        return self.claim is not None and same_place(self.claim, self.effect)

    @property
    def place_in_top(self) -> bool:
        """Right place among the claim and the alternatives that come next, `TOP` in all."""
        if self.claim is None:
            return False
        return any(same_place(entry, self.effect) for entry in (self.claim, *self.claim.alternatives[: TOP - 1]))

    @property
    def physics(self) -> bool:
        """Right place and right physics; a law in no catalogue has to be called unnamed.

        Where the recordings cannot tell the truth from what is claimed, a claim that says so is right.
        """
        if self.claim is None:
            return False
        if not self.effect.catalogued:
            return self.place and not self.claim.named
        if self.claim.named and same_physics(self.claim, self.effect):
            return True
        equivalent = any(same_physics(self.claim, other) for other in self.effect.equivalents or ())
        return equivalent and self.undecided_rightly

    @property
    def undecided_rightly(self) -> bool:
        """The truth is among what the claim says it cannot be told from."""
        return self.claim is not None and any(
            same_physics(other, self.effect) for other in self.claim.indistinguishable_from
        )

    @property
    def parameters(self) -> tuple[tuple[Estimate, TrueParameter], ...]:
        """Pairs of estimate and truth, of parameters that can be compared, where the physics is right."""
        if self.claim is None or not self.physics:
            return ()
        comparable = [truth for truth in self.effect.parameters if truth.sigma_cr is not None]
        pairs = ((_of(truth, self.claim.parameters), truth) for truth in comparable)
        return tuple((estimate, truth) for estimate, truth in pairs if estimate is not None)


def _of(truth: TrueParameter, estimates: Sequence[Estimate]) -> Estimate | None:
    """The estimate of a parameter: of its name, or else the only one of its unit, as two formulas' names differ."""
    named = [estimate for estimate in estimates if estimate.name == truth.name]
    alike = named or [estimate for estimate in estimates if estimate.unit == truth.unit]
    return alike[0] if len(alike) == 1 else None


def same_place(one: Suspect, other: Suspect) -> bool:
    """Port and axis agree; at the transducer, the strongest channel of `one` is a channel of `other`."""
    if (one.port, one.axis) != (other.port, other.axis):
        return False
    return one.port != "transducer" or (bool(one.channels) and one.channels[0] in other.channels)


def same_physics(one: Suspect, other: Suspect) -> bool:
    """Place and family agree."""
    return same_place(one, other) and one.family == other.family


def match(answer: Answer, effects: Sequence[Concealed]) -> tuple[Judged, ...]:
    """Assign claims to effects, each once, such that most is right; one entry an effect, in order."""
    claims = answer.finds
    if not claims or not effects:
        return tuple(Judged(effect, None) for effect in effects)
    merit = np.array([[_merit(Judged(effect, claim)) for claim in claims] for effect in effects])
    rows, columns = linear_sum_assignment(merit, maximize=True)
    chosen = dict(zip(rows.tolist(), columns.tolist(), strict=True))
    return tuple(Judged(effect, claims[chosen[row]] if row in chosen else None) for row, effect in enumerate(effects))


def superfluous(answer: Answer, judged: Sequence[Judged]) -> int:
    """Number of claims that no concealed effect accounts for, not even by its port."""
    return len(answer.finds) - sum(entry.port for entry in judged)


def error_over_bound(estimate: Estimate, truth: TrueParameter) -> float:
    """|estimate - truth| over the Cramer-Rao bound; the difference of phases is taken on the circle."""
    assert truth.sigma_cr is not None
    return abs(_difference(estimate.value, truth)) / truth.sigma_cr


def covered(estimate: Estimate, truth: TrueParameter) -> bool | None:
    """Whether the stated interval holds the truth; None where no interval is stated."""
    if estimate.low is None or estimate.high is None:
        return None
    middle = 0.5 * (estimate.low + estimate.high)
    return abs(_difference(middle, truth)) <= 0.5 * (estimate.high - estimate.low)


def _difference(value: float, truth: TrueParameter) -> float:
    left = value - truth.value
    phase = truth.unit == "rad" and truth.name.startswith("phi")
    return math.remainder(left, 2.0 * math.pi) if phase else left


def _merit(judged: Judged) -> int:
    return 8 * judged.physics + 4 * judged.place + 2 * judged.place_in_top + judged.port
