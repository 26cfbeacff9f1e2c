"""What a key for a quantity expects: unit, shape and bounds."""

from __future__ import annotations

from dataclasses import dataclass

CHANNELWISE = "SI by channel"  # N for forces, N m for torques
PAIRWISE = "SI by channel pair"  # N/N, N/(N m), (N m)/N, (N m)/(N m)

# Beyond what any rig on Earth has, by SI unit; of other units, such as stiffnesses, what can still be computed with.
GREATEST = {"1": 1e9, "m": 1e4, "kg": 1e6, "s": 1e9, "Hz": 1e6, "m/s": 1e4, "m/s^2": 1e4, "A": 1e6, "V": 1e6}
GREATEST |= {"rad": 1e4, "rad/s": 1e5, "rad/s^2": 1e7, "N": 1e8, "N m": 1e8, "kg m^2": 1e8}
GREATEST |= {CHANNELWISE: 1e8, PAIRWISE: 1e4}
_ANY = 1e12


@dataclass(frozen=True, slots=True)
class Kind:
    """What a key expects: SI unit, shape, bound; for a number a wrench channel, the channels recorded."""

    unit: str
    shape: tuple[int, ...] = ()
    low: float | None = None
    strict: bool = False  # `low` itself is refused
    high: float | None = None  # where it is less than the unit's
    channels: tuple[str, ...] = ()
    each_joint: bool = False  # one element for each joint, whatever `shape` says
    of_joint: bool = False  # the unit at a joint that turns: one that slides has m for rad, and N for N m

    @property
    def most(self) -> float:
        """Greatest magnitude."""
        return GREATEST.get(self.unit, _ANY) if self.high is None else self.high

    @property
    def bound(self) -> str:
        """The bounds in words."""
        least = "" if self.low is None else f"{'more than' if self.strict else 'at least'} {self.low:g}, "
        return f"{least}at most {self.most:g}"

    def in_words(self) -> str:
        """Say it in a few words: "(3) m, more than 0"."""
        shape = (
            f"({', '.join(map(str, self.shape))})" if self.shape else "one for each joint" if self.each_joint else ""
        )
        return ", ".join(filter(None, (f"{shape} {self.unit}".strip(), self.bound)))
