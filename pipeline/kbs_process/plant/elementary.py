"""Sine, cosine and floor that the compiler puts inline: calls to the C library took a third of the plant's time.

In compiled effects the name `math` means this module: the standard one with these three in place of its own.
Sine and cosine differ from it by no more than 5e-16 beyond the rounding of the argument, |x| < 1e7; the floor
stays a float, without the way through an integer and back.
"""

from __future__ import annotations

from collections.abc import Callable
from math import atan, atan2, copysign, exp, expm1, fabs, hypot, log, log1p, pi, sqrt, tan, tanh, tau
from types import FunctionType
from typing import Any, TypeVar, cast

import numpy as np
from numba import njit

F = TypeVar("F", bound=Callable[..., object])

__all__ = [
    "atan", "atan2", "copysign", "cos", "exp", "expm1", "fabs", "floor", "hypot", "log", "log1p", "pi", "sin", "sqrt",
    "tan", "tanh", "tau",
]  # fmt: skip

# Only compiled code calls these: no entry from Python, which saves a third of the time to compile. Sums keep
# their order; products may be fused into them, and a division by a constant may multiply by its inverse.
OPTIONS: dict[str, Any] = {
    "error_model": "numpy",
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
    "forceinline": True,
    "fastmath": {"contract", "arcp", "nsz", "nnan", "ninf"},
}
PI_HIGH, PI_LOW = 3.1415926218032837, 3.178650954705639e-08  # the first has 26 bits: its multiples are exact
INVERSE_PI = 0.3183098861837907


def compiled(function: F) -> F:
    """Compile `function` when generated code first calls it."""
    return cast(F, njit(**OPTIONS)(function))


def linked(function: F, compiler: Callable[[F], F], **names: object) -> F:
    """Compile a plain function together with those that it calls by name; `names` take the place of its file's.

    What it calls stands in its own file: the cache of compiled plants knows that file's text.
    """
    assert isinstance(function, FunctionType)
    known = {**function.__globals__, **names}
    for name in function.__code__.co_names:
        if isinstance(known.get(name), FunctionType):
            known[name] = linked(known[name], compiler, **names)
    return compiler(cast(F, FunctionType(function.__code__, known, function.__name__)))


@compiled
def floor(x: float) -> float:
    """Greatest whole number not above x."""
    return float(np.floor(x))


@compiled
def sin(x: float) -> float:
    """Sine: x less a multiple of pi, then a polynomial within half of pi, 2e-16 from the sine."""
    n = floor(x * INVERSE_PI + 0.5)
    r = (x - n * PI_HIGH) - n * PI_LOW
    sign = 1.0 - 2.0 * (n - 2.0 * floor(0.5 * n))
    u = r * r
    low = (0.9999999999999999 - 0.1666666666666603 * u) + u * u * (
        0.008333333333279716 - 0.00019841269824043476 * u
    )
    high = (2.7557316505206813e-06 - 2.5051875237403865e-08 * u) + u * u * (
        1.6047954942468953e-10 - 7.371737705211996e-13 * u
    )
    return sign * r * (low + u * u * (u * u) * high)


@compiled
def cos(x: float) -> float:
    """Cosine: reduced as in `sin`, which the compiler then does once for both, with a polynomial of its own."""
    n = floor(x * INVERSE_PI + 0.5)
    r = (x - n * PI_HIGH) - n * PI_LOW
    sign = 1.0 - 2.0 * (n - 2.0 * floor(0.5 * n))
    u = r * r
    low = (1.0 - 0.4999999999999997 * u) + u * u * (0.04166666666666369 - 0.0013888888888765993 * u)
    high = (2.4801587276204404e-05 - 2.7557316278110303e-07 * u) + u * u * (
        2.087655604032606e-09 - (1.1462747597285266e-11 - 4.60731670620538e-14 * u) * u
    )
    return sign * (low + u * u * (u * u) * high)
