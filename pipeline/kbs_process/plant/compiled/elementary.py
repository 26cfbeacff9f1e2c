"""Functions that the compiler puts inline, and on a processor's vector: it does neither with calls to the C library.

In compiled effects the name `math` means this module: the standard one with these in place of its own. Sine and cosine
differ from it by no more than 5e-16 beyond the rounding of the argument, |x| < 1e7; exponential, logarithm and
hyperbolic tangent by no more than 1e-15 of themselves; the floor stays a float, without the way through an integer.
"""

from __future__ import annotations

from collections.abc import Callable
from math import atan, atan2, copysign, fabs, hypot, pi, sqrt, tan, tau
from types import FunctionType
from typing import Any, TypeVar, cast

import numpy as np
from numba import njit, types
from numba.extending import intrinsic

F = TypeVar("F", bound=Callable[..., object])

__all__ = [
    "atan", "atan2", "copysign", "cos", "exp", "expm1", "fabs", "floor", "hypot", "log", "pi", "sin", "sqrt", "tan",
    "tanh", "tau",
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
LN2_HIGH, LN2_LOW = 0.6931471803691238, 1.9082149292705877e-10  # likewise, with 32 bits
INVERSE_LN2 = 1.4426950408889634
WHOLE, WHOLE_BITS = (6755399441055744.0, 0x4338000000000000)  # 1.5 * 2^52: a whole number added stands in its last bits
ROOT_HALF_BITS = 0x3FE6A09E667F3BCD  # of sqrt(1/2)
LEAST, GREATEST = -708.0, 709.0  # arguments whose exponential is an ordinary number


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
    low = (0.9999999999999999 - 0.1666666666666603 * u) + u * u * (0.008333333333279716 - 0.00019841269824043476 * u)
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


def _bits(typing: Any, x: Any) -> Any:
    """The 64 bits of a float, as a whole number."""

    def code(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        return builder.bitcast(given[0], context.get_value_type(types.int64))

    return types.int64(types.float64), code


def _from_bits(typing: Any, n: Any) -> Any:
    """The float that has the bits of a whole number."""

    def code(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        return builder.bitcast(given[0], context.get_value_type(types.float64))

    return types.float64(types.int64), code


bits = cast(Callable[[float], int], intrinsic(_bits))
from_bits = cast(Callable[[int], float], intrinsic(_from_bits))


@compiled
def scaled(x: float) -> tuple[float, float]:
    """Return s and p with exp(x) = s + s p: s is a power of two, p a polynomial's exp(r) - 1, |r| < ln(2) / 2."""
    x = max(LEAST, min(GREATEST, x))
    n = floor(x * INVERSE_LN2 + 0.5)
    r = (x - n * LN2_HIGH) - n * LN2_LOW
    u = r * r
    low = (0.5 + 0.1666666666666667 * r) + u * (0.04166666666666667 + 0.008333333333326136 * r)
    middle = (0.0013888888888883748 + 0.00019841269874820627 * r) + u * (
        2.4801587325547743e-05 + 2.7557255400206422e-06 * r
    )
    high = (2.75572736431103e-07 + 2.5105217004720745e-08 * r) + u * 2.0914686968086876e-09
    s = from_bits((bits(n + WHOLE) + 1023) << 52)
    return s, r + u * (low + u * u * (middle + u * u * high))


@compiled
def exp(x: float) -> float:
    """Exponential; beyond an ordinary number's range, that of its end."""
    s, p = scaled(x)
    return s + s * p


@compiled
def expm1(x: float) -> float:
    """exp(x) - 1, without the cancellation near zero."""
    s, p = scaled(x)
    return s * p + (s - 1.0)


@compiled
def tanh(x: float) -> float:
    """Hyperbolic tangent, from exp(-2 |x|) - 1."""
    t = expm1(-2.0 * fabs(x))
    return copysign(t / (2.0 + t), x)


@compiled
def log(x: float) -> float:
    """Natural logarithm of an ordinary positive number: of a power of two, and of m within a root of two of one.

    log(m) = 2 artanh(s), s = (m - 1) / (m + 1).
    """
    exponent = (bits(x) - ROOT_HALF_BITS) >> 52
    s = from_bits(bits(x) - (exponent << 52))
    s = (s - 1.0) / (s + 1.0)
    n = from_bits(exponent + WHOLE_BITS) - WHOLE
    u = s * s
    low = (0.666666666666667 + 0.39999999999899444 * u) + u * u * (0.2857142862600327 + 0.22222211130259878 * u)
    high = (0.18182889455674947 + 0.15331710618210773 * u) + u * u * 0.14616585424888623
    return n * LN2_HIGH + (2.0 * s + (s * u * (low + u * u * (u * u) * high) + n * LN2_LOW))
