"""What is mutated, and how one mutated input is judged."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

Outcome = Literal["refused", "right", "reported", "wrong", "fault", "hang", "memory"]
OUTCOMES: tuple[Outcome, ...] = ("refused", "right", "reported", "wrong", "fault", "hang", "memory")
BAD: tuple[Outcome, ...] = ("wrong", "fault", "hang", "memory")

Tell = Callable[[Outcome], None]  # called as soon as an outcome is certain should the process die, and again


@dataclass(frozen=True, slots=True)
class Subject:
    """One kind of input: its share of all, how a sound one is made, changed, and judged."""

    name: str
    share: float
    make: Callable[[Path], None]  # writes the sound input into a folder
    mutate: Callable[[random.Random, Path], str]  # changes it in place, and says how
    judge: Callable[[Path, Tell], None]  # reads it; what is raised is a refusal, or a fault


def damaged(rng: random.Random, data: bytes) -> tuple[bytes, str]:
    """Bytes with one thing wrong that disks, networks and crashes do to files."""
    at = rng.randrange(len(data))
    size = min(len(data) - at, 2 ** rng.randrange(10))
    part = data[at : at + size]
    match rng.randrange(7):
        case 0:
            bit = rng.randrange(8)
            return data[:at] + bytes([data[at] ^ 1 << bit]) + data[at + 1 :], f"bit {bit} of byte {at}"
        case 1:
            return data[:at] + rng.randbytes(size) + data[at + size :], f"{size} random bytes at {at}"
        case 2:
            return data[:at], f"cut at {at}"
        case 3:
            return data[:at] + data[at + size :], f"{size} bytes at {at} missing"
        case 4:
            return data[:at] + part + data[at:], f"{size} bytes at {at} twice"
        case 5:
            return data[:at] + bytes(size) + data[at + size :], f"{size} zero bytes at {at}"
        case _:
            return data[:at] + rng.randbytes(size) + data[at:], f"{size} more bytes at {at}"
