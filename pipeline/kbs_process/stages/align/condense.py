"""One recording, chunk by chunk, to one clock and the working rate.

Every stream is put in order, laid on a uniform grid of its own clock and decimated as it passes; only about
twice the working rate is kept. When the recording has been read, clocks are known, and the kept samples are
interpolated at the instants of one common axis. So a clock is fitted to the whole recording although no
sample at the full rate is ever kept, and a clock's offset and skew cost no second interpolation.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from kbs_process.errors import RecordingError
from kbs_process.signals.records import (
    SPIKE,
    WRENCH_CHANNELS,
    WRENCH_UNITS,
    Array,
    Block,
    Clock,
    Envelope,
    Events,
    Loss,
    Run,
    Signal,
    Stretch,
)
from kbs_process.stages.align.clocks import align
from kbs_process.stages.align.resample import Kept, design
from kbs_process.stages.align.stream import ONE_PART, Collected, Timeline, Uniform

Progress = Callable[[str, int], None]  # stream, samples just taken

SLOWEST = 100.0  # times that a stream may be slower than the working rate
# Brought to the working rate; the first one present is the reference.
SAMPLED = ("wrench", "effort", "angle", "rate", "pointing", "accelerometer", "gyro")
BESIDE = ("pointing", "accelerometer", "gyro")  # of these, what nothing that is judged leans on
LOADS = ("wrench", "effort")  # the first one present has spectrum and envelope
TURNING = ("angle", "pointing")  # of joints, where they turn
SLOW = ("command", "field", "temperature")  # kept sample by sample: one a control cycle, or slower
_OUT = "or leave this recording out of campaign.toml"
# What to do where a stream holds next to no numbers.
_NO_NUMBERS = {
    "wrench": f"take a channel that is dead out of transducer.channels in the parameter files, {_OUT}",
    "effort": f"leave the effort of a joint whose channel is dead out of the parameter files, {_OUT}",
    "angle": f"list the joints that are read as `joints` of [topics.encoder] in campaign.toml, {_OUT}",
    "rate": f"record the rates again, or leave topics.rate out where angles are recorded, {_OUT}",
    **{key: f"leave topics.{key} out of campaign.toml, {_OUT}" for key in BESIDE},
    "command": f"record the commands, {_OUT}",
}
DOUBT = 1e-3  # largest weight of invented samples in a valid one


@dataclass(frozen=True, slots=True)
class CondenseSettings:
    """What is kept of a recording."""

    working_rate_Hz: float = 20.0
    spectrum_resolution_Hz: float = 0.1  # at least as fine
    spectrum_limit_Hz: float = 100.0
    envelope_stretches: int = 2000
    encoder_limit_Hz: float = 200.0  # encoders sampled faster are not kept sample by sample


def condense(
    name: str,
    blocks: Iterable[tuple[str, Block]],
    channels: Mapping[str, tuple[str, ...]],
    settings: CondenseSettings,
    progress: Progress | None = None,
    units: Mapping[str, tuple[str, ...]] | None = None,
    file: str | None = None,
    *,
    keep_spikes: bool = False,
) -> Run:
    """Reduce a recording to a `Run`; `channels` names the columns of every stream that `blocks` brings.

    `units` are those of streams of the joints that are not rad or rad/s throughout; `file` is what errors call the
    recording, its name without it. With `keep_spikes` single bad samples are told, and stay, as of a
    prediction, which is nobody's reading.

    Time zero is the reference stream's first sample (the wrench's, where there is one), and the axis covers
    that stream. Samples that lean on invented input (gaps, the ends' continuation, times at which a stream
    had not begun or had ended) by more than `DOUBT` of the filter's weight are flagged.

    Raises RecordingError where a sampled stream is empty or shorter than the filters, or no command is a number.
    """
    load = next((key for key in LOADS if key in channels), None)
    streams: dict[str, Uniform | Collected] = {
        key: _stream(
            name, file or name, key, columns, settings, (units or {}).get(key), is_load=key == load, keep=keep_spikes
        )
        for key, columns in channels.items()
    }
    for key, block in blocks:
        if len(block):
            streams[key].push(block)
            if progress is not None:
                progress(key, len(block))
    sampled = {key: s for key in SAMPLED if isinstance(s := streams.get(key), Uniform)}
    slow = {key: s for key in SLOW if isinstance(s := streams.get(key), Collected)}
    kept = {key: _finished(key, stream, settings, file or name) for key, stream in sampled.items()}
    collected = {key: stream.finish() for key, stream in slow.items()}
    if "command" in slow and (line := slow["command"].line).samples == line.non_finite > 0:
        raise RecordingError(
            f"{_whole(line)}: nothing says what drove the joints",
            where=_place(file or name, "command"),
            remedy=_NO_NUMBERS["command"],
        )
    if not kept:
        raise RecordingError(
            "the recording brings neither wrench nor joint angles, and no effort",
            where=name,
            remedy="check the [topics] of campaign.toml",
        )
    reference = next(iter(kept))
    present = {key: s.line for key, s in streams.items() if s.line.samples}
    clocks = align({key: line.clock() for key, line in present.items()}, reference)
    if (found := set_clock({key: sampled[key].line for key in kept})) is not None:
        raise RecordingError(found[1], where=_place(file or name, found[0]), remedy=ONE_PART)
    _check_overlap(present, clocks, reference, kept, file or name)

    dt = 1.0 / settings.working_rate_Hz
    count = int(np.floor(sampled[reference].line.span / dt * (1.0 + 1e-12))) + 1
    meanings = {key: _meaning(key, channels[key], (units or {}).get(key)) for key in kept}
    signals = {key: _signal(kept[key], channels[key], meanings[key], clocks[key], dt, count) for key in kept}
    events = {
        key: Events(_on_axis(own, clocks[key]), values, channels[key])
        for key, (own, values) in collected.items()
        if len(own)
    }
    encoder = sampled["angle"].samples() if "angle" in sampled else None
    loaded = None if load is None else sampled.get(load)
    unread = [Loss("missing", s.line.where, 0, detail="not one sample") for s in slow.values() if not s.line.samples]
    return Run(
        name=name,
        wrench=signals.get("wrench"),
        angle=signals.get("angle"),
        rate=signals.get("rate"),
        command=events.get("command"),
        field=events.get("field"),
        temperature=_temperature(events["temperature"], dt, count) if "temperature" in events else None,
        encoder=Events(_on_axis(encoder[0], clocks["angle"]), encoder[1], channels["angle"]) if encoder else None,
        spectrum=loaded.welch.result() if loaded and loaded.welch else None,
        envelope=_envelope(loaded) if loaded else None,
        epoch_ns=present[reference].first_stamp,
        log_epoch_ns=present[reference].clock().first_log,
        rates={key: line.grid.rate for key, line in present.items() if line.grid is not None},
        losses=(*_losses(present, clocks), *unread),
        clocks=clocks,
        pointing=signals.get("pointing"),
        accelerometer=signals.get("accelerometer"),
        gyro=signals.get("gyro"),
        effort=signals.get("effort"),
        stretches=tuple(
            Stretch(kind, clocks[key].offset_s + (1.0 + clocks[key].skew) * own, length, likely and key in LOADS)
            for key in kept
            for kind, own, length, likely in sampled[key].line.stretches()
            if key in LOADS or (kind == SPIKE and key not in BESIDE)
        ),
        gaps=np.concatenate([_on_axis(sampled[key].gaps(), clocks[key]) for key in kept if key not in BESIDE]),
        reach=max(one.design.leaning(DOUBT) for one in kept.values()),
    )


def set_clock(lines: Mapping[str, Timeline]) -> tuple[str, str] | None:
    """Find a stream whose log - stamp steps for good, where stamps of this stream or another jump with it; in words."""
    for key, line in lines.items():
        if (step := line.floor_step()) is None:
            continue
        for other, jumping in lines.items():
            at = step.own + (line.clock().first_log - jumping.clock().first_log) * 1e-9
            if jumping.jumps(step, at):
                whose = "encoder" if other == "angle" else other
                return key, (
                    f"log times less stamps step by {step.by:+.4g} s, {step.own:.4g} s after the first sample, and "
                    f"stamps of {whose} jump there: a clock was set"
                )
    return None


def _check_overlap(
    lines: dict[str, Timeline], clocks: dict[str, Clock], reference: str, kept: Iterable[str], file: str
) -> None:
    """Raise RecordingError where a stream that is sampled lies all before or all after the reference."""
    for key in kept:
        start = clocks[key].offset_s
        if start > lines[reference].span or start + lines[key].span < 0.0:
            raise RecordingError(
                f"its first sample comes {start:.6g} s after that of {reference}: the two have no time in common",
                where=_place(file, key),
                remedy="look for stamps of another time zone or unit, or an unset clock, with `kbs-process inspect`",
            )


def _losses(lines: dict[str, Timeline], clocks: dict[str, Clock]) -> list[Loss]:
    return [loss for key, line in lines.items() for loss in line.losses(clocks[key].offset_s, 1.0 + clocks[key].skew)]


def _stream(
    name: str,
    file: str,
    key: str,
    columns: tuple[str, ...],
    settings: CondenseSettings,
    units: Sequence[str] | None,
    *,
    is_load: bool,
    keep: bool,
) -> Uniform | Collected:
    where = f"{name}: {key}"
    if key in SLOW:
        return Collected(where, columns, _place(file, key), smooth=key == "temperature", keep_spikes=keep)
    if key not in SAMPLED:
        raise KeyError(f"no stream is called {key!r}")
    if is_load:
        return Uniform(
            where,
            columns,
            settings.working_rate_Hz,
            spectrum=(settings.spectrum_resolution_Hz, settings.spectrum_limit_Hz),
            stretches=settings.envelope_stretches,
            file=_place(file, key),
            keep_spikes=keep,
            lively=key == "wrench",
        )
    angle = key == "angle"
    return Uniform(
        where,
        columns,
        settings.working_rate_Hz,
        turning=[unit == "rad" for unit in units or ["rad"] * len(columns)] if key in TURNING else (),
        keep_below=settings.encoder_limit_Hz if angle else 0.0,
        file=_place(file, key),
        keep_spikes=keep,
        lively=key in TURNING,
    )


def _finished(key: str, stream: Uniform, settings: CondenseSettings, file: str) -> Kept:
    kept, line = stream.finish(), stream.line
    if line.grid is not None and line.grid.rate * SLOWEST < settings.working_rate_Hz:
        raise RecordingError(
            f"samples come every {1 / line.grid.rate:.3g} s, and the working rate is {settings.working_rate_Hz:g} Hz",
            where=_place(file, key),
            remedy="check the unit of its times; of a sensor as slow as that no band can be judged",
        )
    if kept is not None:
        return kept
    if line.grid is None:
        raise RecordingError(
            f"{line.samples} samples are no signal",
            where=_place(file, key),
            remedy=f"check the topic of {key} in campaign.toml, and the file with `kbs-process inspect`",
        )
    least = design(line.grid.rate, settings.working_rate_Hz).extension + 1
    needed = f"the filters to {settings.working_rate_Hz:g} Hz need {least} ({least / line.grid.rate:.3g} s)"
    if line.non_finite:
        what, remedy = f"{_whole(line)}, and {needed}", _NO_NUMBERS[key]
    else:
        what = f"{line.samples} samples in {line.span:.3g} s are too few: {needed}"
        remedy = "record longer, or leave this recording out of campaign.toml"
    raise RecordingError(what, where=_place(file, key), remedy=remedy)


def _place(file: str, key: str) -> str:
    return f"{file}: {'encoder' if key == 'angle' else key}"  # as in campaign.toml


def _whole(line: Timeline) -> str:
    """How many samples of a stream can be used, and which channels hold NaN or infinity in the others."""
    left = line.samples - line.non_finite or "none"
    return f"{left} of {line.samples} samples can be used (NaN or infinite: {line.non_finite_channels})"


def _on_axis(own: Array, clock: Clock) -> Array:
    t: Array = clock.offset_s + (1.0 + clock.skew) * own
    return t


def _signal(
    kept: Kept, columns: tuple[str, ...], meaning: tuple[tuple[str, ...], str], clock: Clock, dt: float, count: int
) -> Signal:
    t = dt * np.arange(count, dtype=np.float64)
    values, doubt = kept.at((t - clock.offset_s) / (1.0 + clock.skew))
    units, frame = meaning
    return Signal(0.0, dt, values, columns, units, frame, doubt <= DOUBT, (_story(kept, clock, dt),))


def _meaning(key: str, columns: tuple[str, ...], units: tuple[str, ...] | None) -> tuple[tuple[str, ...], str]:
    """Units and frame of a stream."""
    if key == "wrench":
        return tuple(WRENCH_UNITS[WRENCH_CHANNELS.index(channel)] for channel in columns), "T"
    if key in ("accelerometer", "gyro"):
        return units or (), key
    return units or ("rad/s" if key == "rate" else "rad",) * len(columns), "joint"


def _story(kept: Kept, clock: Clock, dt: float) -> str:
    d = kept.design
    aligned = f"clock: {clock.source}"
    if clock.source == "fitted":
        aligned += (
            f", offset {clock.offset_s:.6f} s +- {1e3 * clock.sigma_offset_s:.2g} ms,"
            f" skew {1e6 * clock.skew:.2f} +- {1e6 * clock.sigma_skew:.2g} ppm"
        )
    return (
        f"{d.rate:.6g} Hz to {1.0 / dt:g} Hz by linear-phase Kaiser filters: gain error <= 1e-5 up to"
        f" {d.passband:.3g} Hz, aliases into that <= -120 dB; {aligned}"
    )


def _envelope(stream: Uniform) -> Envelope | None:
    grid = stream.line.grid
    if stream.envelope is None or grid is None:
        return None
    return stream.envelope.result(0.0, grid.period_ns * 1e-9)


def _temperature(events: Events, dt: float, count: int) -> Signal:
    """Interpolate linearly: a temperature follows its sensor's time constant, far below the working rate."""
    t = dt * np.arange(count, dtype=np.float64)
    values = np.column_stack([np.interp(t, events.t, column) for column in events.values.T])
    valid = (t >= events.t[0]) & (t <= events.t[-1])
    units = ("degC",) * len(events.channels)
    return Signal(0.0, dt, values, events.channels, units, "T", valid, ("linear interpolation",))
