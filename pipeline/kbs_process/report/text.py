"""Numbers and units as a reader wants to see them."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Sequence

from kbs_process.signals.records import WRENCH_CHANNELS

MISSING = "–"
_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_TIDY = {"^2": "²", "^3": "³", "*": "·", "SI by channel pair": "SI", " ": "\u00a0"}
_TENSOR = ("xx", "yy", "zz", "xy", "xz", "yz")
_BY_CHANNEL = ("bias", "noise", "resolution")  # the transducer's: one number a channel


def number(value: float | None, digits: int = 3) -> str:
    """Return `value` to `digits` significant digits, or a dash where there is none."""
    if value is None or not math.isfinite(value):
        return MISSING
    if value == 0.0:
        return "0"
    exponent = _exponent(value)
    if _readable(exponent):
        return _sign(f"{value:.{max(0, digits - 1 - exponent)}f}")
    # By its digits: the power of ten of a number that is next to nothing is no number.
    mantissa, power_of_ten = f"{value:.{digits - 1}e}".split("e")
    return f"{_sign(mantissa)}\u00a0×\u00a010{_raised(int(power_of_ten))}"


def measure(value: float | None, sigma: float | None, digits: int = 4) -> str:
    """Return "value ± sigma" with sigma to two significant digits and value to the same decimal."""
    if value is None or not math.isfinite(value):
        return MISSING
    if sigma is None or not math.isfinite(sigma) or sigma <= 0.0:
        return number(value, digits)
    exponent = _exponent(max(abs(value), sigma))
    scale = 1.0 if _readable(exponent) else 10.0**exponent
    decimals = min(9, max(0, 1 - _exponent(sigma / scale)))
    pair = f"{_sign(f'{value / scale:.{decimals}f}')}\u00a0±\u00a0{sigma / scale:.{decimals}f}"
    return pair if scale == 1.0 else f"({pair})\u00a0×\u00a010{_raised(exponent)}"


def exact(value: float) -> str:
    """Return a number that somebody chose, a limit or a band's edge, as it was written."""
    return _sign(f"{value:.12g}")


def percent(value: float | None, digits: int = 3) -> str:
    """Return a fraction in percent."""
    return MISSING if value is None else f"{number(100.0 * value, digits)}\u00a0%"


def unit(name: str) -> str:
    """Return an SI unit with raised powers and without line breaks."""
    for plain, tidy in _TIDY.items():
        name = name.replace(plain, tidy)
    return name


def element(name: str) -> str:
    """Return a number's name with the axis or the channels that its index means: body.arm.cog[0] is body.arm.cog x."""
    if not (found := re.fullmatch(r"(.*\.(\w+))\[(\d)(?:,(\d))?\]", name)):
        return name
    stem, key, row, column = found.groups()
    if column:
        return f"{stem} {WRENCH_CHANNELS[int(row)]} <- {WRENCH_CHANNELS[int(column)]}"
    meaning = _TENSOR if key == "inertia" else WRENCH_CHANNELS if key in _BY_CHANNEL else "xyz"
    return f"{stem} {meaning[int(row)]}"


def band_hz(low: float | None, high: float | None) -> str:
    """Return a frequency band in words."""
    if low is None:
        return "unfiltered" if high is None else f"below {exact(high)}\u00a0Hz"
    if high is None:
        return f"above {exact(low)}\u00a0Hz"
    return f"{exact(low)} to {exact(high)}\u00a0Hz"


def count(n: int, noun: str, plural: str = "") -> str:
    """Return "1 warning" or "3 warnings"."""
    return f"{n} {noun if n == 1 else plural or noun + 's'}"


def label(text: str, longest: int = 48) -> str:
    """Return `text` fit for a figure: printable, on one line, not too long."""
    line = "".join(character if character.isprintable() else " " for character in text)
    return line if len(line) <= longest else line[: longest - 1] + "…"


def power(value: float) -> str:
    """Return a short label for a tick of a logarithmic axis: 0.5, 20, 10⁻⁵, 5·10⁻⁵."""
    exponent = _exponent(value * 1.000001)  # a decade's own rounding must not put it below itself
    mantissa = round(value / 10.0**exponent)
    if -3 <= exponent < 4:
        return number(value, 1)
    return f"{'' if mantissa == 1 else f'{mantissa}·'}10{_raised(exponent)}"


def chance(log10: float) -> str:
    """Return a probability from its logarithm, which may be too small for a float: 0.04, 10⁻²²⁰."""
    return number(10.0**log10, 2) if log10 > -3.0 else f"10{_raised(round(log10))}"


def steps(values: Sequence[float]) -> list[str]:
    """Return labels for ticks at equal steps, all with the decimals that tell them apart: 0.00, 0.25, 2·10⁻⁶."""
    largest = max((abs(value) for value in values), default=0.0)
    if largest == 0.0:
        return ["0"] * len(values)
    exponent = 0 if _readable(_exponent(largest)) else _exponent(largest)
    scaled = [value / 10.0**exponent for value in values]
    step = min((abs(b - a) for a, b in itertools.pairwise(scaled)), default=abs(scaled[0]))
    decimals = next((n for n in range(12) if abs(round(step, n) - step) < 1e-3 * step), 12)
    suffix = f"·10{_raised(exponent)}" if exponent else ""
    return [_sign(f"{value + 0.0:.{decimals}f}") + (suffix if value else "") for value in scaled]


def _exponent(value: float) -> int:
    return math.floor(math.log10(abs(value)))


def _readable(exponent: int) -> bool:
    return -4 <= exponent < 5


def _raised(exponent: int) -> str:
    return str(exponent).translate(_SUPERSCRIPT)


def _sign(text: str) -> str:
    return text.replace("-", "−")


def frame_label(frame: str) -> str:
    """Return a frame in words."""
    names = {"S": "spacecraft (S)", "T": "transducer (T)", "joint": "the joints"}
    return names.get(frame, frame)
