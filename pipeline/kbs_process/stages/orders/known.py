"""Which orders a joint has by its description: its turn, its motor's turn and electrical cycle, and its effects'."""

from __future__ import annotations

from collections.abc import Sequence

from kbs_process.plant.effect import Effect
from kbs_process.rig.model import Drive, Joint

_HARMONICS = (1, 2, 3, 4)  # of a motor's turn, where lines are narrow enough to tell them apart
_APART = 4.0  # lines between two of them


def known_orders(joint: Joint, effects: Sequence[Effect]) -> dict[str, float]:
    """Return cycles in a turn of the joint by what makes them; effects are those that act in the model."""
    found = {"turn of the joint": 1.0}
    if joint.drive is None:
        return found
    ratio, has = float(joint.drive.ratio), joint.drive.parameters
    found |= {"motor turn": ratio, "motor step": ratio * float(joint.drive.steps_per_turn)}
    if "Kangle" in has:
        found["electrical cycle"] = ratio * float(has["Kangle"])
    for effect in effects:
        name = effect.name.replace("_", " ")
        orders = [one for one in effect.parameters if effect.port.of_drive and one.is_order and one.name in has]
        if effect.periods:
            found[name] = ratio * effect.periods
        for one in orders:
            found[name] = abs(float(has[one.name])) * _turns(one.proposed, joint.drive)
    return found


def _turns(kind: str, drive: Drive) -> float:
    """Periods in a turn of the joint to one of the angle that an order counts in: the motor's, a cycle's or its own."""
    ratio = float(drive.ratio)
    cycles = float(drive.parameters.get("Kangle", 1.0))
    return {"motor order": ratio, "cycle order": ratio * cycles}.get(kind, 1.0)


def coincident(order: float, resolution: float, known: dict[str, float]) -> tuple[str, ...]:
    """Return what has an order within half of a line's width, the motor's turn with its lowest multiples."""
    found = []
    for name, base in known.items():
        for times in _HARMONICS if name == "motor turn" and base > _APART * resolution else (1,):
            if abs(order - times * base) <= 0.5 * resolution:
                found.append(name if times == 1 else f"{name} × {times}")
    return tuple(found)
