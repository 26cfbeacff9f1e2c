"""numba's `njit`, with a cache of machine code that is made anew where it does not load.

A cache is damaged by a full disk, a copy that ends early or a kill at the wrong time; numba raises whatever unpickling
raises then, at every later start, and runs machine code as it finds it. So code is kept with its SHA-256. Whoever
compiles takes `njit` from here, and copies arrays number by number: for an assignment of slices numba compiles the
text of its error as well, for ten seconds of a first start. Functions of others are cached as numba does it: what one
has kept, the other could not load.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable
from contextlib import suppress
from hashlib import sha256
from typing import Any, TypeVar, cast

import numba
from numba.core.caching import CompileResultCacheImpl, FunctionCache
from numba.core.serialize import dumps

from kbs_process import interruption

__all__ = ["njit"]
Function = TypeVar("Function", bound=Callable[..., Any])


class _Proven(CompileResultCacheImpl):
    """What is kept of one function, with its SHA-256."""

    def reduce(self, data: Any) -> tuple[bytes, bytes]:
        """Return the digest of what is kept, and that."""
        kept: bytes = dumps(super().reduce(data))  # type: ignore[no-untyped-call]
        return sha256(kept).digest(), kept

    def rebuild(self, target_context: Any, payload: tuple[bytes, bytes]) -> Any:
        """Return what was kept, if it is as it was."""
        digest, kept = payload
        if sha256(kept).digest() != digest:
            raise ValueError("damaged machine code")
        return super().rebuild(target_context, pickle.loads(kept))  # type: ignore[no-untyped-call]


class _RenewedCache(FunctionCache):
    """The cache of one function."""

    _impl_class = _Proven

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return what is kept for a signature, or None: then it is compiled, and kept."""
        interruption.check()
        try:
            return super().load_overload(sig, target_context)  # type: ignore[no-untyped-call]
        except Exception:  # noqa: BLE001 - unpickling damaged bytes raises anything at all
            with suppress(OSError):
                self.flush()  # type: ignore[no-untyped-call]
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep what is compiled, if there is room: else it is compiled at each start."""
        with suppress(OSError):
            super().save_overload(sig, data)  # type: ignore[no-untyped-call]


def njit(*signatures: Any, cache: bool = False, **options: Any) -> Callable[[Function], Function]:
    """Compile a function as `numba.njit` does, at once for `signatures`."""

    def compiled(function: Function) -> Function:
        dispatcher: Any = numba.njit(**options)(function)
        if cache:
            dispatcher._cache = _RenewedCache(function)  # type: ignore[no-untyped-call]
        for signature in signatures:
            dispatcher.compile(signature)
        if signatures:
            dispatcher.disable_compile()
        return cast("Function", dispatcher)

    return compiled
