"""What a key for a quantity expects: unit, shape and bound."""

from __future__ import annotations

from dataclasses import dataclass

CHANNELWISE = "SI by channel"  # N for forces, N m for torques
PAIRWISE = "SI by channel pair"  # N/N, N/(N m), (N m)/N, (N m)/(N m)


@dataclass(frozen=True, slots=True)
class Kind:
    """What a key expects: SI unit, shape, bound; for a number a wrench channel, the channels recorded."""

    unit: str
    shape: tuple[int, ...] = ()
    low: float | None = None
    strict: bool = False  # `low` itself is refused
    channels: tuple[str, ...] = ()
    each_joint: bool = False  # one element for each joint, whatever `shape` says
    of_joint: bool = False  # the unit at a joint that turns: one that slides has m for rad, and N for N m

    @property
    def bound(self) -> str:
        """The bound in words."""
        return "" if self.low is None else f"{'more than' if self.strict else 'at least'} {self.low:g}"

    def in_words(self) -> str:
        """Say it in a few words: "(3) m, more than 0"."""
        shape = (
            f"({', '.join(map(str, self.shape))})" if self.shape else "one for each joint" if self.each_joint else ""
        )
        return ", ".join(filter(None, (f"{shape} {self.unit}".strip(), self.bound)))
