"""Units that a campaign may write, by dimension, with their factor to SI: the core computes in SI alone."""

from __future__ import annotations

from math import pi

from kbs_process.errors import did_you_mean

_LBF = 4.4482216152605  # N
# dimension -> unit -> factor; the first unit of each dimension is the SI unit.
DIMENSIONS: dict[str, dict[str, float]] = {
    "pure number": {"1": 1.0, "%": 1e-2},
    "length": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254, "ft": 0.3048},
    "mass": {"kg": 1.0, "g": 1e-3, "lb": 0.45359237},
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0},
    "frequency": {"Hz": 1.0, "kHz": 1e3},
    "sweep rate": {"Hz/s": 1.0, "kHz/s": 1e3},
    "rate of growth": {"1/s": 1.0, "1/min": 1.0 / 60.0},
    "velocity": {"m/s": 1.0, "mm/s": 1e-3, "km/h": 1.0 / 3.6},
    "acceleration": {"m/s^2": 1.0, "mm/s^2": 1e-3},
    "angle": {
        "rad": 1.0,
        "mrad": 1e-3,
        "urad": 1e-6,
        "deg": pi / 180.0,
        "arcmin": pi / 10800.0,
        "arcsec": pi / 648000.0,
    },
    "angular rate": {"rad/s": 1.0, "mrad/s": 1e-3, "deg/s": pi / 180.0, "rpm": pi / 30.0},
    "angular acceleration": {"rad/s^2": 1.0, "deg/s^2": pi / 180.0},
    "force": {"N": 1.0, "mN": 1e-3, "kN": 1e3, "lbf": _LBF},
    "torque": {
        "N m": 1.0,
        "mN m": 1e-3,
        "N mm": 1e-3,
        "N cm": 1e-2,
        "kN m": 1e3,
        "lbf in": _LBF * 0.0254,
        "lbf ft": _LBF * 0.3048,
    },
    "moment of inertia": {
        "kg m^2": 1.0,
        "kg cm^2": 1e-4,
        "kg mm^2": 1e-6,
        "g m^2": 1e-3,
        "g cm^2": 1e-7,
        "g mm^2": 1e-9,
    },
    "rotational stiffness": {"N m/rad": 1.0, "kN m/rad": 1e3, "N mm/rad": 1e-3, "N m/mrad": 1e3, "N m/deg": 180.0 / pi},
    "rotational damping": {"N m s/rad": 1.0, "N mm s/rad": 1e-3, "N m s/deg": 180.0 / pi, "N m/rpm": 30.0 / pi},
    "linear damping": {"N s/m": 1.0, "N s/mm": 1e3},
    "electric current": {"A": 1.0, "mA": 1e-3},
    "electric tension": {"V": 1.0, "mV": 1e-3},
    "curved rotational stiffness": {"N m/rad^2": 1.0},
    "cubic rotational stiffness": {"N m/rad^3": 1.0},
    "rotational drag": {"N m s^2/rad^2": 1.0},
    "linear stiffness": {"N/m": 1.0, "N/mm": 1e3},
    "temperature": {"degC": 1.0},
}

_DIMENSION_OF = {unit: dimension for dimension, units in DIMENSIONS.items() for unit in units}
_PARTED = str.maketrans({" ": "", "*": "", "·": "", "-": "", "_": "", "²": "^2"})  # spelt otherwise, or not at all
_SPELT = {unit.translate(_PARTED): unit for unit in _DIMENSION_OF} | {
    "°": "deg",
    "degrees": "deg",
    "°/s": "deg/s",
    "°C": "degC",
    "sec": "s",
    "inlbf": "lbf in",
    "inlb": "lbf in",
    "ftlbf": "lbf ft",
    "ftlb": "lbf ft",
}


class UnitMismatchError(ValueError):
    """A unit is unknown, or belongs to another dimension; `remedy` says which would do."""

    def __init__(self, what: str, remedy: str) -> None:
        super().__init__(what)
        self.remedy = remedy


def alike(unit: str, other: str) -> bool:
    """Say whether two units are of one dimension; units that are not in the table are alike if they are the same."""
    return unit == other or (unit in _DIMENSION_OF and _DIMENSION_OF[unit] == _DIMENSION_OF.get(other))


def spelt(stated: str) -> str:
    """Return a unit with a dimension as campaigns write it, however a file spells it ("Nm", "ft-lb"); "" if unknown."""
    known = _SPELT.get(stated.translate(_PARTED), "")
    return known if dimension(known) != "pure number" else ""


def dimension(unit: str) -> str:
    """Return a unit's dimension, "" of one that is not in the table."""
    return _DIMENSION_OF.get(unit, "")


def to_si(unit: str) -> float:
    """Return the factor of a unit to the SI unit of its dimension, 0 of one that is not in the table."""
    return DIMENSIONS.get(dimension(unit), {}).get(unit, 0.0)


def agree(stated: str, unit: str) -> bool | None:
    """Say whether a unit as files spell it ("Nm", "N*m") is the same as `unit`, None where it is not in the table."""
    known = _SPELT.get(stated.translate(_PARTED), stated)
    if unit == known or known not in _DIMENSION_OF:
        return True if unit == known else None
    return alike(known, unit) and DIMENSIONS[_DIMENSION_OF[known]][known] == DIMENSIONS[_DIMENSION_OF[unit]][unit]


def factor(unit: str, expected: str) -> float:
    """Return what turns a number in `unit` into the SI unit `expected`.

    Raises UnitMismatchError where `unit` is of another dimension than `expected`, or not in the table.
    """
    if unit == expected:
        return 1.0
    dimension = _DIMENSION_OF.get(expected)
    allowed = DIMENSIONS[dimension] if dimension else {expected: 1.0}
    if unit in allowed:
        return allowed[unit]
    wanted = f"{dimension} ({expected})" if dimension else f"'{expected}'"
    examples = ", ".join(f"'{name}'" for name in allowed)
    if unit in _DIMENSION_OF:
        raise UnitMismatchError(
            f"unit '{unit}' is a unit of {_DIMENSION_OF[unit]}, where {wanted} is expected", f"use one of {examples}"
        )
    hint = did_you_mean(unit, allowed)
    remedy = hint if hint.startswith("did") else f"use one of {examples}"
    raise UnitMismatchError(f"unit '{unit}' is not known, where {wanted} is expected", remedy)
