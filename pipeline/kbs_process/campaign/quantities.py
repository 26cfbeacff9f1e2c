"""One quantity of a parameter file: { value, unit, sigma, source } to SI."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from kbs_process.campaign.documents import within
from kbs_process.campaign.formats.kind import CHANNELWISE, PAIRWISE, Kind
from kbs_process.campaign.formats.tables import PlainQuantity, QuantityTable
from kbs_process.campaign.units import UnitMismatchError, factor
from kbs_process.errors import ConfigError
from kbs_process.files import regular
from kbs_process.rig.model import Quantity
from kbs_process.signals.records import WRENCH_CHANNELS, WRENCH_UNITS, Array

LEAST = 1e-15  # of what is measured or made, in SI: below, squares and ratios are none that can be computed with
_NEAREST = 1e-6  # of the distance from its bound: what a number is that must not reach it


def read_quantity(name: str, table: QuantityTable | PlainQuantity, kind: Kind, folder: Path) -> Quantity:
    """Return the quantity in SI; CSV files are looked for in `folder`.

    Raises ConfigError, its `where` being the key inside the table at fault.
    """
    given = _array(table.value, "value", folder)
    value = _shaped(given, kind, "value", scalar_fills=not given.any())
    sigma = _shaped(_array(table.sigma, "sigma", folder), kind, "sigma", scalar_fills=True)
    scale = _scale(table.unit, kind)
    with np.errstate(over="ignore"):
        value, sigma = value * scale, sigma * scale
    for key, array in (("value", value), ("sigma", sigma)):
        if not (np.abs(array) <= kind.most).all():
            what = f"is {_extreme(array):.3g} in SI: nothing on a test bench is so large"
            raise ConfigError(what, where=key, remedy=f"check number and unit; give at most {kind.most:g}")
        tiny = (array != 0.0) & (np.abs(array) < LEAST)
        if (key == "sigma" or kind.strict) and tiny.any():
            what = f"is {array[tiny].flat[0]:.3g} in SI: nothing on a test bench is so small"
            raise ConfigError(what, where=key, remedy=f"check number and unit; give {LEAST:g} or more")
    if (sigma < 0.0).any():
        raise ConfigError("a standard deviation is negative", where="sigma", remedy="give 0 or more")
    if kind.low is not None and ((value <= kind.low) if kind.strict else (value < kind.low)).any():
        raise ConfigError(f"{table.value} is out of bounds", where="value", remedy=f"give {kind.bound}")
    return Quantity(name, value, kind.unit, sigma, table.source, _least(value, kind))


def _least(value: Array, kind: Kind) -> Array | float:
    """Return the least that a fit may make of a value: where the bound itself is refused, close to it."""
    if kind.low is None:
        return -np.inf
    return kind.low + _NEAREST * (value - kind.low) if kind.strict else kind.low


def quantity_or_fault(
    name: str, table: QuantityTable | PlainQuantity, kind: Kind, folder: Path
) -> tuple[Quantity, ConfigError | None]:
    """Return the quantity in SI; where it cannot be read, zeros in its place and the fault."""
    try:
        return read_quantity(name, table, kind, folder), None
    except ConfigError as error:
        zero = np.zeros(kind.shape)
        return Quantity(name, zero, kind.unit, zero, ""), error


def _extreme(array: Array) -> float:
    """Return the element that is largest, or none of the numbers that there are."""
    return float(array.flat[int(np.argmax(np.where(np.isfinite(array), np.abs(array), np.inf)))])


def _array(given: Any, key: str, folder: Path) -> Array:
    if isinstance(given, str):
        return from_csv(within(folder, given, where=key), key)
    try:
        array = np.asarray(given, dtype=np.float64)
    except ValueError as error:
        raise ConfigError("rows differ in length", where=key, remedy="give rows of equal length") from error
    return array


def from_csv(path: Path, key: str) -> Array:
    """Read a matrix of numbers from a comma-separated file; '#' begins a comment. One row is an array."""
    try:
        with regular(path).open(encoding="utf-8") as file:  # of a name, loadtxt would unpack .gz, however large
            array = np.loadtxt(file, delimiter=",", ndmin=2)
    except FileNotFoundError as error:
        raise ConfigError(f"the CSV file '{path}' does not exist", where=key, remedy="check its name") from error
    except OSError as error:
        what = f"the CSV file '{path}' cannot be read: {error.strerror}"
        raise ConfigError(what, where=key, remedy="check its name and its permissions") from error
    except (ValueError, UnicodeDecodeError) as error:
        remedy = "one row a line, numbers separated by commas, '#' before comments"
        raise ConfigError(f"the CSV file '{path}' is no matrix: {error}", where=key, remedy=remedy) from error
    if not np.isfinite(array).all():
        raise ConfigError(f"the CSV file '{path}' holds NaN or infinities", where=key, remedy="correct the file")
    matrix: Array = array[0] if len(array) == 1 else array
    return matrix


def _shaped(array: Array, kind: Kind, key: str, *, scalar_fills: bool) -> Array:
    """Return the array in the expected shape; channels that are not recorded get 0."""
    if array.shape == kind.shape:
        return array
    if array.shape == () and scalar_fills:
        return np.full(kind.shape, float(array))
    if kind.channels and array.shape == (len(kind.channels),):
        full = np.zeros(kind.shape)
        full[[WRENCH_CHANNELS.index(channel) for channel in kind.channels]] = array
        return full
    wanted = _in_words(kind.shape)
    if kind.channels and len(kind.channels) < len(WRENCH_CHANNELS):
        wanted += f", or {len(kind.channels)}, one for each of {', '.join(kind.channels)}"
    raise ConfigError(f"is {_in_words(array.shape)}, where {wanted} is expected", where=key, remedy=f"give {wanted}")


def _in_words(shape: tuple[int, ...]) -> str:
    match shape:
        case ():
            return "one number"
        case (n,):
            return f"an array of {n}"
        case _:
            return f"a matrix of {' x '.join(map(str, shape))}"


def _scale(unit: str | list[str], kind: Kind) -> Array:
    """Return the factors to SI: one for all elements, or one for each."""
    if unit == kind.unit:
        return np.asarray(1.0)
    if kind.unit == PAIRWISE:
        raise ConfigError(f"unit '{unit}' is not known here", where="unit", remedy=f'give unit = "{PAIRWISE}"')
    if isinstance(unit, str):
        expected = set(_expected(kind, len(kind.channels)))
        if len(expected) == 1:
            return np.asarray(_factor(unit, expected.pop()))
        remedy = f'give a list, such as ["N", "N", "N", "N m", "N m", "N m"], or "{CHANNELWISE}"'
        raise ConfigError(f"unit '{unit}' does not go for forces and torques alike", where="unit", remedy=remedy)
    expected_units = _expected(kind, len(unit))
    if len(unit) != len(expected_units):
        remedy = f"give one unit, or {len(expected_units)}"
        raise ConfigError(f"lists {len(unit)} units for {len(expected_units)} elements", where="unit", remedy=remedy)
    factors = [_factor(one, si) for one, si in zip(unit, expected_units, strict=True)]
    return _shaped(np.array(factors), kind, "unit", scalar_fills=False)


def _expected(kind: Kind, count: int) -> tuple[str, ...]:
    """Return the SI unit of each element, where a list of `count` is given."""
    if kind.unit != CHANNELWISE:
        return (kind.unit,) * (kind.shape[0] if kind.shape else 1)
    if count == len(kind.channels):
        return tuple(WRENCH_UNITS[WRENCH_CHANNELS.index(channel)] for channel in kind.channels)
    return WRENCH_UNITS


def _factor(unit: str, expected: str) -> float:
    try:
        return factor(unit, expected)
    except UnitMismatchError as error:
        raise ConfigError(str(error), where="unit", remedy=error.remedy) from error
