"""What flows through the pipeline: immutable arrays with their channels, units, frame and history."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Stamps = NDArray[np.int64]
Mask = NDArray[np.bool_]

WRENCH_CHANNELS = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")
WRENCH_UNITS = ("N", "N", "N", "N m", "N m", "N m")


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """A contiguous piece of one stream at its full rate, in the order of the file."""

    stamp: Stamps  # (n,) sensor clock, ns
    log: Stamps  # (n,) recorder clock, ns
    values: Array  # (n, c) one column for each channel asked for

    def __len__(self) -> int:
        return len(self.stamp)


@dataclass(frozen=True, slots=True, eq=False)
class Signal:
    """Uniformly sampled channels in one frame.

    `valid` is False where a sample was invented (a gap) or where a filter's edge still shows.
    `history` lists, oldest first, what was done to the samples.
    """

    t0: float  # s, first sample, on the recording's own time axis
    dt: float  # s
    values: Array  # (n, c)
    channels: tuple[str, ...]
    units: tuple[str, ...]
    frame: str  # "T", "S", "joint", ...
    valid: Mask  # (n,)
    history: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        n, c = self.values.shape
        if len(self.channels) != c or len(self.units) != c or len(self.valid) != n:
            raise ValueError(
                f"{n} x {c} values with channels {self.channels}, units {self.units}, {len(self.valid)} flags"
            )

    def __len__(self) -> int:
        return len(self.values)

    @property
    def t(self) -> Array:
        """Time of each sample, s, shape (n,)."""
        t: Array = self.t0 + self.dt * np.arange(len(self.values), dtype=np.float64)
        return t

    @property
    def rate(self) -> float:
        """Sampling rate, Hz."""
        return 1.0 / self.dt

    def column(self, channel: str) -> Array:
        """Samples of one channel, shape (n,)."""
        column: Array = self.values[:, self.channels.index(channel)]
        return column

    def derive(self, values: Array, step: str, *, frame: str | None = None, valid: Mask | None = None) -> Signal:
        """Return the same channels with new values, `step` added to the history."""
        return replace(
            self,
            values=values,
            frame=self.frame if frame is None else frame,
            valid=self.valid if valid is None else valid,
            history=(*self.history, step),
        )


def beside(first: Signal, second: Signal) -> Signal:
    """Return the channels of two signals on one grid, those of `first` before the others; the frame is its own."""
    return replace(
        first,
        values=np.concatenate([first.values, second.values], axis=1),
        channels=first.channels + second.channels,
        units=first.units + second.units,
        valid=first.valid & second.valid,
        history=(*first.history, *(f"{', '.join(second.channels)}: {step}" for step in second.history)),
    )


@dataclass(frozen=True, slots=True, eq=False)
class Events:
    """A slow stream kept sample by sample: commands, field positions, temperatures."""

    t: Array  # (n,) s on the recording's own time axis
    values: Array  # (n, c)
    channels: tuple[str, ...]


BLOW = "blow"  # samples that look single in one channel, while others move: kept, and told
PUT_IN_ORDER = "put in order"  # messages that came after younger ones: told, although nothing is lost by that
ROUNDED = "rounded stamps"  # behind which a regular rate was found: likewise
COPY = "copy"  # of another recording, whose readings it has
DROPOUT = "dropout"  # a channel that stood still off all its other readings: left out, likewise
MISSING = "gap"  # rows that are not there, or no numbers
SPIKE = "spike"  # single samples off their neighbours: interpolated, and the figures with them are told as well
TRUNCATED = "truncated"  # the loss of a file that breaks off: all that would have followed


@dataclass(frozen=True, slots=True)
class Loss:
    """Something that a recording should hold and does not, or holds twice, damaged or in another order."""

    kind: str  # "gap", "repeat", "out of order", "crc", "truncated", "undecodable", "non-finite", ...
    where: str  # file and topic
    count: int  # messages or blocks concerned
    start_s: float | None = None  # on the recording's own time axis, where known
    end_s: float | None = None
    detail: str = ""

    @property
    def real(self) -> bool:
        """Whether anything is missing, doubtful or left out by it."""
        return self.kind not in (PUT_IN_ORDER, ROUNDED, BLOW, "clocks apart")


@dataclass(frozen=True, slots=True)
class Stretch:
    """Readings that were bridged: left out as bad, or of loads also those that are not there, or no numbers."""

    kind: str  # that of its `Loss`
    start: float  # s, on the recording's own time axis
    length: float  # s
    likely: bool  # whether what happened may be the cause, by this recording alone


@dataclass(frozen=True, slots=True, eq=False)
class Spectrum:
    """One-sided cross-spectral density matrix of a stream at its full rate (Welch)."""

    f: Array  # (m,) Hz
    S: NDArray[np.complex128]  # (m, c, c), units of channel i times channel j per Hz
    channels: tuple[str, ...]
    averages: int
    alternating: Array  # (c,) rms of what changes its sign from sample to sample, beyond noise and blows


@dataclass(frozen=True, slots=True, eq=False)
class Envelope:
    """Least and greatest value of every channel in equal stretches of time, for plots of the full rate."""

    t: Array  # (m,) s, middle of each stretch
    low: Array  # (m, c)
    high: Array  # (m, c)


@dataclass(frozen=True, slots=True)
class Clock:
    """How one stream's stamps map to the run's time axis: t = offset_s + (1 + skew) (stamp - first stamp)."""

    offset_s: float  # s, where the stream's first sample lies
    skew: float  # rate of the stream's clock against the axis, less 1
    sigma_offset_s: float  # s, at the middle of the recording; nan where the clocks cannot be compared
    sigma_skew: float
    latency_s: float  # s, mean latency of the recorder above the least seen
    source: str  # "reference", "fitted", "same as ...", "recorder", "not comparable"


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """One recording (or the prediction of one), reduced to the working rate on one clock.

    All signals share t0 and dt. A channel that the rig does not have is None.
    """

    name: str
    wrench: Signal | None  # channels: a subset of WRENCH_CHANNELS, on the transducer, about T's origin
    angle: Signal | None  # encoder angle of each joint, rad
    rate: Signal | None  # measured rate of each joint, rad/s, on rigs that record that
    command: Events | None  # desired position and rate of each joint: "az", "el", "az.rate", "el.rate"
    field: Events | None  # field position of each motor, motor rad
    temperature: Signal | None  # degC
    encoder: Events | None  # encoder angles at their own rate, where the controller needs them
    spectrum: Spectrum | None  # of the wrench, or of the efforts of a rig without a transducer
    envelope: Envelope | None  # likewise
    epoch_ns: int  # sensor clock at the recording's time zero
    log_epoch_ns: int = 0  # recorder clock at the recording's time zero
    rates: dict[str, float] = dataclasses.field(default_factory=dict)  # Hz, measured, by stream
    losses: tuple[Loss, ...] = ()
    clocks: dict[str, Clock] = dataclasses.field(default_factory=dict)  # by stream
    pointing: Signal | None = None  # angle of each joint by an external instrument, rad
    accelerometer: Signal | None = None  # (n, 3) m/s^2, along its own axes, gravity taken off
    gyro: Signal | None = None  # (n, 3) rad/s
    effort: Signal | None = None  # of each joint that has it measured, in the unit in which it is recorded
    stretches: tuple[Stretch, ...] = ()  # that were bridged
    gaps: Array = dataclasses.field(
        default_factory=lambda: np.zeros((0, 2))
    )  # s, from when to when samples are made up; infinite beyond the ends of a stream
    reach: float = 0.0  # s beside these in which filters to the working rate lean on them

    @property
    def loads(self) -> Signal | None:
        """Return all loads that were recorded as one signal: the wrench's channels, then the efforts."""
        if self.wrench is None:
            return self.effort
        return self.wrench if self.effort is None else beside(self.wrench, self.effort)

    @property
    def load_rates(self) -> Array:
        """Rate (c,) at which each channel of `loads` was sampled, Hz."""
        measured = {"wrench": self.wrench, "effort": self.effort}
        return np.array(
            [self.rates[key] for key, signal in measured.items() if signal is not None for _ in signal.channels],
            dtype=np.float64,
        )
