"""What a column is, by its name and unit. What these do not tell stays a question."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from kbs_process.campaign.documents import QUESTION
from kbs_process.campaign.units import dimension, spelt
from kbs_process.recordings.tables import Column

_LONGEST = 20  # characters of a unit
_PARTS = re.compile(r"[A-Za-z0-9]+")
_LOAD = re.compile(r"(f|force|m|mom|moment|t|torque)([xyz])|([xyz])(force|moment|torque)", re.IGNORECASE)
_TIMES = {"t", "time", "timestamp", "stamp", "zeit", "clock"}
_COMMANDED = {"cmd", "command", "commanded", "demand", "desired", "ref", "reference", "set", "setpoint", "target"}
_DERIVED = {"error", "err", "deviation", "difference"}
_WORDS = {"angle", "angles", "position", "positions", "pos", "enc", "encoder", "winkel", "actual", "meas"}
_ANGLES = _WORDS - {"actual", "meas"} | {"az", "el", "azimuth", "elevation", "joint"}
_RATES = {"velocity", "velocities", "vel", "rate", "speed", "effort", "torque", "torques", "current", "acceleration"}
_ROTATION = re.compile(
    r"(?:q|quat|quaternion|orientation|attitude)([wxyz])|(?:r|rot|rotation|dcm|matrix)([1-3][1-3])"
    r"|(?:q|quat|quaternion|orientation|attitude|rotation|dcm|matrix)(\d)"
)


@dataclass(frozen=True, slots=True)
class Meaning:
    """What a column is for; of no use to a campaign where `stream` is empty."""

    column: str
    stream: str = ""  # "time", "wrench", "encoder", "orientation"
    channel: str = ""  # "Fx", a joint's name, "w" of a quaternion, "12" of a matrix, or a number "3" in either
    unit: str = QUESTION  # as campaigns write it


def meaning(column: Column) -> Meaning:
    """Return what a column's name and unit tell."""
    base, unit = _parted(column)
    path = [[word.lower() for word in _PARTS.findall(part)] for part in re.split(r"[/.\[]", base)]
    words = path[-1]
    if len(path) > 1 and len("".join(words)) == 1:  # an axis, or a place: of what, the part before says
        words = path[-2] + words
    around = {word for part in path for word in part}
    kind = dimension(unit)
    if set(words) & _TIMES and kind in ("time", ""):
        return Meaning(column.name, "time", unit=unit)
    if load := _LOAD.fullmatch("".join(words)):
        first, axis = (load[1], load[2]) if load[1] else (load[4], load[3])
        force = first[0].lower() == "f"
        fits = kind == ("force" if force else "torque")
        return Meaning(column.name, "wrench", f"{'F' if force else 'T'}{axis.lower()}", unit if fits else QUESTION)
    if (turned := _ROTATION.fullmatch("".join(words))) and not kind:
        return Meaning(column.name, "orientation", next(filter(None, turned.groups())), "1")
    moved = kind == "angle" or (kind in ("length", "") and around & _ANGLES and not around & _RATES)
    if set(words) & (_COMMANDED | _DERIVED) or around & (_COMMANDED - {"set"} | {"field"}) or not moved:
        return Meaning(column.name, unit=unit)
    name = "_".join(word for word in words if word not in _WORDS)
    return Meaning(column.name, "encoder", name if name[:1].isalpha() else f"joint{name}", unit)


def _parted(column: Column) -> tuple[str, str]:
    """Return a column's name without its unit, and the unit: of the file, in brackets, or the name's last words."""
    name = column.name.strip()
    base, told = _in_brackets(name)
    if stated := column.unit or told:
        return base, spelt(stated) or QUESTION
    for cut in re.finditer(r"[\s_,/]+", name):
        if len(name) - cut.end() <= _LONGEST and (unit := spelt(name[cut.end() :])):
            return name[: cut.start()], unit
    return name, QUESTION


def bracketed(name: str) -> str:
    """Return the unit in brackets at the end of a column's name, "" where there is none that is known."""
    return spelt(_in_brackets(name.strip())[1])


def _in_brackets(name: str) -> tuple[str, str]:
    """Return a name, and what is in brackets at its end; "position[az]" is an element of something, and has none."""
    opened = max(name.rfind(sign) for sign in "[({") if name.endswith(("]", ")", "}")) else -1
    told = name[opened + 1 : -1] if opened >= 0 else ""
    if name[opened : opened + 1] == "[" and name[opened - 1].strip() and not spelt(told):
        told = ""
    return (name[:opened], told) if told else (name, "")


def by_channel(columns: Sequence[Meaning]) -> dict[str, Meaning]:
    """Return columns by channel or joint; where several may be meant, which one is a question."""
    found: dict[str, Meaning] = {}
    for one in columns:
        twice = one.channel in found
        found[one.channel] = Meaning(QUESTION, one.stream, one.channel) if twice else one
    return found


def rotation(columns: Sequence[Meaning]) -> tuple[str, ...]:
    """Return columns as an orientation: w, x, y, z or a matrix row by row; none where they are not all, or too many.

    Which of four numbered ones is the scalar is a question; nine are taken by rows, as else the inverse is meant.
    """
    found = {one.channel: one.column for one in columns}
    if len(found) < len(columns):
        return ()
    if sorted(found) == sorted("wxyz"):
        return tuple(found[axis] for axis in "wxyz")
    numbered = len(found) in (4, 9) and all(len(channel) == 1 for channel in found)
    if numbered and len(found) == 4:
        return (QUESTION,) * 4
    return tuple(found[place] for place in sorted(found)) if len(found) == 9 else ()


def runs_of(names: Sequence[str]) -> dict[str, str]:
    """Return the files of one logger, in their order, by what tells them apart: the name without what all share."""
    parts = {name: re.findall(r"[A-Za-z0-9]+", name.rpartition(".")[0] or name) for name in names}
    shared = set.intersection(*map(set, parts.values())) if len(names) > 1 else set()
    runs = {"_".join(part for part in parts[name] if part not in shared): name for name in names}
    told = len(runs) == len(names) and "" not in runs
    return runs if told else {f"run{number}": name for number, name in enumerate(names, start=1)}
