"""Trials: drawn, made, sealed; and what the bench asks of whoever makes them."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, cast

import msgspec

from proof import seal, truth
from proof.bundle import SEAL, SEAL_DIGEST, pack
from proof.words import Split


class Maker(Protocol):
    """What makes campaigns with concealed effects; a specification is all that one depends on."""

    def draw(self, split: Split, count: int, seed: int) -> Sequence[Any]:
        """Return specifications of `count` trials."""

    def make(self, specification: Any, folder: Path) -> dict[str, Any]:
        """Write a campaign into an empty folder, and return what is true of it."""


@dataclass(frozen=True, slots=True)
class Order:
    """A trial to be made."""

    name: str
    specification: Any
    public_key: bytes


def generator() -> Maker:
    """Return the generator of this checkout."""
    from proof.concealed import trials

    return cast(Maker, trials)


def make_sealed(order: Order, make: Callable[[Any, Path], dict[str, Any]]) -> bytes:
    """Make a trial and return its folder, packed, what is concealed sealed in it."""
    with tempfile.TemporaryDirectory(prefix="make-") as scratch:
        folder = Path(scratch) / order.name
        folder.mkdir()
        told = make(order.specification, folder) | {"trial": order.name}
        add_seal(folder, msgspec.convert(told, truth.Truth), order.public_key)
        return pack(folder)


def add_seal(folder: Path, told: truth.Truth, public_key: bytes) -> None:
    """Write the seal of a trial and its SHA-256 into the trial's folder."""
    sealed = seal.seal(truth.encode(told), public_key, told.trial)
    (folder / SEAL).write_bytes(sealed)
    (folder / SEAL_DIGEST).write_text(f"{seal.digest(sealed)}  {SEAL}\n")


def break_seal(sealed: bytes, stated: str, key: bytes, trial: str) -> truth.Truth:
    """Return what is true of a trial; SealError if its seal is not the one whose digest was stated."""
    if seal.digest(sealed) != stated.split()[0]:
        raise seal.SealError(f"the seal of {trial} is not the one that its folder states")
    return truth.decode(seal.unseal(sealed, key, trial))
