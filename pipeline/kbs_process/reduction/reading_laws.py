"""What a model's sensors and clocks make of a prediction: readings instead of true values."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from scipy.interpolate import CubicSpline

from kbs_process.campaign.config import Campaign, SensingLaw
from kbs_process.campaign.sensing_laws import LAWS
from kbs_process.diagnosis.screening.signature import sensed, unit_values
from kbs_process.diagnosis.screening.suspects import Candidate
from kbs_process.plant.sensing import BY, SensingPort
from kbs_process.rig.model import Rig
from kbs_process.signals.records import WRENCH_CHANNELS, Array, Block, Signal

_READ = ("wrench", "effort", "angle")  # streams that sensors make


def read_through(
    campaign: Campaign, streams: Iterable[tuple[str, Block]], temperature: Signal | None
) -> Iterator[tuple[str, Block]]:
    """Yield predicted streams as the model's sensors would read them; without such laws block by block, as they come.

    A law may remember what it has read: streams that laws change are kept until they are whole.
    """
    if not campaign.sensing:
        yield from streams
        return
    kept: dict[str, list[Block]] = {}
    for key, block in streams:
        if key in _READ:
            kept.setdefault(key, []).append(block)
        else:
            yield key, block
    for key, blocks in kept.items():
        values = np.concatenate([block.values for block in blocks])
        stamp = np.concatenate([block.stamp for block in blocks])
        log = np.concatenate([block.log for block in blocks])
        names = columns(key, campaign.rig)
        read = readings(campaign.sensing, key, names, stamp * 1e-9, values, campaign.rig, temperature)
        yield key, Block(stamp, log, read)


def columns(key: str, rig: Rig) -> tuple[str, ...]:
    """Return the names of a predicted stream's columns."""
    if key == "wrench":
        return WRENCH_CHANNELS
    names = rig.joint_names
    if key == "effort":
        return (*names, *(f"{name}.rate" for name in names), *(f"{name}.effort" for name in names))
    return names


def readings(
    laws: Sequence[SensingLaw],
    key: str,
    names: Sequence[str],
    t: Array,
    values: Array,
    rig: Rig,
    temperature: Signal | None,
) -> Array:
    """(n, c) values at t (n,) s with the changes by all laws that act on their stream.

    Each law sees the values before any of them: they are small, as the diagnosis that found them had them. A clock's
    stamps are late by what all of its laws make together, and what they stamp is what was read then.
    """
    late = np.zeros(len(t))
    warmth = None if temperature is None else np.interp(t, temperature.t, temperature.values[:, 0])
    read = values.copy()
    for entry in laws_on(laws, key, names):
        law = LAWS[entry.law]
        amplitudes = [one.name for one in law.amplitudes]
        numbers = {name: float(quantity) for name, quantity in entry.parameters.items()}
        shape = tuple((name, value) for name, value in numbers.items() if name not in amplitudes)
        if "temperature" in law.arguments and warmth is None:
            continue
        known = {} if warmth is None else {"temperature": warmth}
        candidate, sizes = Candidate(law, entry.site, shape), np.array([numbers[name] for name in amplitudes])
        if law.port is SensingPort.STREAM:
            late += unit_values(candidate, t, known) @ sizes
        else:
            read += sensed(candidate, t, values, names, rig, known) @ sizes
    return CubicSpline(t, read)(np.clip(t - late, t[0], t[-1])) if late.any() else read


def laws_on(laws: Sequence[SensingLaw], key: str, names: Sequence[str]) -> list[SensingLaw]:
    """Return the laws that act on a predicted stream, whose columns are `names`."""
    return [entry for entry in laws if _acts(entry, key, names)]


def _acts(entry: SensingLaw, key: str, names: Sequence[str]) -> bool:
    match LAWS[entry.law].port:
        case SensingPort.STREAM:
            return key in _READ and (key == "angle") == (entry.site == "encoder")
        case SensingPort.ENCODER:
            return key == "angle"
        case _:
            return key in ("wrench", "effort") and entry.site.split(BY)[0] in names
