"""Lines in what a fit leaves: tones of time, orders of angles, as shapes to try beside the grids of the catalogue."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.fft import fft, next_fast_len
from scipy.ndimage import median_filter

from kbs_process.diagnosis.screening.ranges import by_parameter
from kbs_process.diagnosis.smoothing.balance import FIRST_JOINT
from kbs_process.diagnosis.smoothing.basis import BAND_HZ
from kbs_process.diagnosis.smoothing.fit import State
from kbs_process.diagnosis.smoothing.problem import Problem
from kbs_process.signals.records import Array

_LINES = 3  # of each kind and joint
_CELLS = 20  # of an angle to a turn of the highest order
_FINE = 4.0  # steps of an order or a frequency to the width of a line
_ORDERS = {"motor order": 420.0, "joint order": 500.0, "disc order": 1000.0}  # the highest
_TURNS = 2.0  # in what was swept, fewer of which are an offset and a slope
_TONE_TURNS = 10.0  # in a recording, fewer of which are drift
_AROUND = 41  # frequencies among which a tone stands out
_WHOLE = 0.02  # of a number of periods in an electrical cycle
_OF_ITS_SHAPE = 8.0  # orders of a disc; higher ones are of its grating


def proposed(problem: Problem, state: State, left: Sequence[Array]) -> dict[str, tuple[float, ...]]:
    """Values of shapes: parameter, of one site "name.site" -> values. `left` (n, rows) is what no number takes up."""
    tones = tones_in(left, problem.experiment.dt)
    found: dict[tuple[str, str], tuple[float, ...]] = {(kind, ""): tones for kind in ("tone", "swept tone", "beat")}
    dt = problem.experiment.dt
    for j, joint in enumerate(problem.rig.joints):
        assert joint.drive is not None
        assert joint.encoder is not None
        alike = {k: g for g, members in enumerate(problem.groups) for k in members}
        angles = [state.ideal_motion(problem, alike[k])[0][:, FIRST_JOINT + j] for k in range(len(left))]
        fields = [recording.field.angle[:, j] for recording in problem.recordings]
        forces, readings = (
            [part[:, place.start + j] for part in left] for place in (problem.joint, problem.angles)
        )  # fmt: skip
        motor = orders_in(fields, forces, dt, _ORDERS["motor order"])
        turned = orders_in(angles, forces, dt, _ORDERS["joint order"])
        disc = orders_in(angles, readings, dt, _ORDERS["disc order"])
        whole = tuple(dict.fromkeys(float(round(order)) for order in disc))
        cycles = float(joint.drive.parameters["Kangle"])
        found["motor order", joint.name] = motor + tuple(order / float(joint.drive.ratio) for order in turned)
        found["cycle order", joint.name] = tuple(
            float(round(order / cycles)) for order in motor if abs(order / cycles - round(order / cycles)) < _WHOLE
        )
        found["joint order", joint.name] = turned
        found["period", joint.name] = tuple(2.0 * np.pi / order for order in dict.fromkeys((*whole, *disc)))
        found["disc order", joint.name] = tuple(order for order in whole if order <= _OF_ITS_SHAPE)
        code = float(joint.encoder.step)
        found["disc bits", joint.name] = tuple(
            float(np.log2(2.0 * np.pi / (code * order))) for order in disc if order > _OF_ITS_SHAPE
        )
    return by_parameter(found)


def tones_in(left: Sequence[Array], dt: float) -> tuple[float, ...]:
    """Frequencies, Hz, that stand out of their neighbours in any row; their phases are each recording's own."""
    longest = max(len(part) for part in left)
    n = next_fast_len(int(_FINE) * longest)
    f = np.asarray(np.fft.rfftfreq(n, dt), dtype=np.float64)
    power = sum(np.abs(np.fft.rfft(part, n, axis=0)) ** 2 for part in left)
    usual = median_filter(power, size=(_AROUND * int(_FINE), 1))
    inside = (f > _TONE_TURNS / (dt * longest)) & (f < BAND_HZ)
    standing = np.where(inside, np.max(power / np.maximum(usual, 1e-300), axis=1), 0.0)
    return _peaks(f, standing, _FINE * f[1])


def orders_in(angles: Sequence[Array], series: Sequence[Array], dt: float, highest: float) -> tuple[float, ...]:
    """Orders of an angle at which series have most power in all recordings together, with one phase."""
    angle, values = np.concatenate(angles), np.concatenate(series)
    turns = np.ptp(angle) / (2.0 * np.pi)
    rate = max(np.abs(np.gradient(one)).max() for one in angles) / dt
    if not turns > 0.0 or not rate > 0.0:
        return ()
    first, apart = _TURNS / turns, 1.0 / (_FINE * turns)
    orders = np.arange(first, min(highest, 2.0 * np.pi * BAND_HZ / rate * _TONE_TURNS), apart)
    if len(orders) < 3:
        return ()
    count = next_fast_len(_CELLS * len(orders))
    cell = np.floor(angle * (apart / (2.0 * np.pi)) % 1.0 * count).astype(np.intp) % count
    turned = np.exp(-1j * orders[0] * angle) * values
    total = np.bincount(cell, turned.real, count) + 1j * np.bincount(cell, turned.imag, count)
    return _peaks(orders, np.abs(fft(total)[: len(orders)]) ** 2, _FINE * apart)


def _peaks(at: Array, power: Array, width: float) -> tuple[float, ...]:
    """Where power has its greatest peaks, as far apart as a line is wide."""
    found: list[float] = []
    inner = np.flatnonzero((power[1:-1] >= power[:-2]) & (power[1:-1] >= power[2:])) + 1
    for i in inner[np.argsort(-power[inner], kind="stable")]:
        if len(found) < _LINES and all(abs(at[i] - other) >= width for other in found):
            found.append(float(at[i]))
    return tuple(found)
