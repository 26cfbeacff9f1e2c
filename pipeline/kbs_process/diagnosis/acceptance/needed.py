"""Finds that later ones made needless.

What was found first may have stood in for what was found later, or for phases that had not been found yet.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from kbs_process.diagnosis.acceptance.finding import Tried, explained_share
from kbs_process.diagnosis.acceptance.outcome import Find, Refused
from kbs_process.diagnosis.acceptance.remains import blind, missed, too_little
from kbs_process.diagnosis.acceptance.verdict import gated
from kbs_process.diagnosis.experiments.floor import Floor
from kbs_process.diagnosis.experiments.hypothesis import Simulate
from kbs_process.diagnosis.experiments.thresholds import CLEAR, SHADE, STAYS_SIGMA
from kbs_process.diagnosis.facts import Place
from kbs_process.diagnosis.nominal.costs import GROSS
from kbs_process.diagnosis.nominal.joint import Own, Standing, without
from kbs_process.diagnosis.nominal.known import Known
from kbs_process.diagnosis.nominal.settling import bent, detected, searched
from kbs_process.diagnosis.proposing.tryout import identity
from kbs_process.diagnosis.screening.screen import Found


@dataclass(frozen=True, slots=True, eq=False)
class Accepted:
    """A law that was accepted, and how it is told."""

    tried: Tried
    find: Find
    before: Standing  # what was believed without it


def in_the_shade(found: Found, accepted: Sequence[Accepted]) -> tuple[str, ...]:
    """Return why a law does not stand beside a far greater find at the same joint or channel; nothing, if it does."""
    for other in accepted:
        there = other.find.identity
        share = found.score.rho_eff / other.find.rho_eff
        if _where(identity(found.suspect).place) == _where(there.place) and not share >= SHADE:
            return (f"is {100.0 * share:.1f} % of {there.law} there: its formula may be as far from nature's",)
    return ()


def _where(one: Place) -> tuple[str, ...]:
    """Mechanics of a joint, its encoder, its field, or a channel."""
    sensed = one.port in ("transducer", "encoder", "clock", "controller")
    return (one.port if sensed else "mechanics", one.site, *one.channels[:1])


def needed(
    accepted: Sequence[Accepted], standing: Standing, floor: Floor, simulate: Simulate
) -> tuple[list[Accepted], Standing, tuple[Refused, ...]]:
    """Leave out what later finds made needless: each has to pass the gate once more, as the last of all.

    Finds of one law at one place are one. When one falls, the others are judged again without it. Returns those that
    stay, what is believed with them, and why the others fell.
    """
    kept, fallen = list(accepted), list[Refused]()
    while True:
        judged: list[Accepted] = []
        for group in _alike(kept):
            own = sum((one.tried.own for one in group), Own((), ()))
            if not own.names:
                judged += group
                continue
            # Nothing has changed since it was found, and what was believed then was all that could be. With another
            # law between its parts it has not gained all that was gained since.
            last = not fallen and kept[-len(group) :] == group and not group[0].before.known.gross
            if last and _clear(group[0].before.known, standing.known):
                told, reasons = group, _missed(group[0].before, standing, own, simulate)
                rest = without(standing, own, simulate) if reasons else standing
            else:
                rest = without(standing, own, simulate)
                told, reasons = _again(group, own, rest, standing, floor, simulate, alone=group == kept)
                there = detected(rest, floor, standing.known.experiment.fit)
                if not (last or there.left or bent(rest, floor)):
                    reasons = (*reasons, "later finds do what it did")
            if reasons:
                fallen.append(Refused(group[0].find.identity, group[0].find.rho_eff, reasons))
                kept = [one for one in kept if one not in group]
                standing = rest
                break
            judged += told
        else:
            return sorted(judged, key=lambda one: _place(one, accepted)), standing, tuple(fallen)


def _clear(before: Known, after: Known) -> bool:
    """Whether a law gains so much that numbers alone, begun where they are beside it, cannot do as well.

    Along a measured motion no minima have to be told apart.
    """
    return not searched(before.experiment) or before.cost - after.cost > CLEAR * before.fit_rows


def _missed(rest: Standing, standing: Standing, own: Own, simulate: Simulate) -> tuple[str, ...]:
    """Why recordings that were not used, and in which the law does something, speak against it."""
    if not missed(rest.known, standing.known):
        return ()
    return missed(rest.known, standing.known, blind(standing, own, simulate))


def _vital(without: Known, known: Known) -> bool:
    """Whether a law does what no other find does, by far: without it as much more is left as the floor has.

    It passed when it was found. Recordings that it does little in may be predicted worse with it beside another law,
    as phases that are not theirs are, and that says nothing against it.
    """
    return without.excess - known.excess > GROSS * known.fit_rows


def _again(
    group: Sequence[Accepted],
    own: Own,
    rest: Standing,
    standing: Standing,
    floor: Floor,
    simulate: Simulate,
    *,
    alone: bool,
) -> tuple[list[Accepted], tuple[str, ...]]:
    """Finds of one law as the last of all, after `rest`, as they are told then; and why they fall, if they do.

    The gate's reasons count for nothing where the law is not `alone` and does what no other does.
    """
    verdict = gated(group[0].tried.found, rest, standing, own, simulate, least=STAYS_SIGMA)
    vital = not alone and _vital(rest.known, standing.known)
    reasons = (
        *(() if vital else verdict.reasons),
        *too_little(rest, standing, floor, sigmas=verdict.sigmas),
        *_missed(rest, standing, own, simulate),
    )
    if len(group) > 1:
        return list(group), reasons
    (one,) = group
    told = replace(one.find, gate=verdict, held_out_variance=explained_share(rest.known, standing.known))
    return [replace(one, find=told)], reasons


def _alike(accepted: Sequence[Accepted]) -> list[list[Accepted]]:
    """Finds of one law at one place together."""
    groups: dict[object, list[Accepted]] = {}
    for one in accepted:
        groups.setdefault(one.find.identity, []).append(one)
    return list(groups.values())


def _place(one: Accepted, accepted: Sequence[Accepted]) -> int:
    return next(k for k, other in enumerate(accepted) if other.tried is one.tried)
