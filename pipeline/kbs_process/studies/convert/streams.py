"""From the columns of a source file to the streams of a recording, a piece at a time."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from collections.abc import Mapping as MappingOf
from dataclasses import dataclass, field
from itertools import chain

import numpy as np

from kbs_process.campaign.units import agree
from kbs_process.errors import RecordingError
from kbs_process.recordings.tables import Cells, Column, Table, find_column
from kbs_process.signals.records import Array, Block, Mask, Stamps
from kbs_process.stages.align.arrival import Arrival
from kbs_process.stages.align.condense import SLOW
from kbs_process.stages.align.stream import FAR_SLOW_NS, STAMP_EACH
from kbs_process.studies.convert.clock import nanoseconds, numbers
from kbs_process.studies.convert.mapping import Channel, Mapping, StreamMap
from kbs_process.studies.convert.mapping_file import Part, Time, Turn
from kbs_process.studies.convert.naming import bracketed
from kbs_process.studies.convert.orientation import Attitude

_NO_STAMPS = np.empty(0, dtype=np.int64)
_SET_BACK = {3600.0: "clocks went from summer to winter time", 43200.0: "it has twelve hours, without a.m. and p.m."}
_FEWEST = 16  # rows that show how fine times are
_LONGEST_S = 3e9  # of a recording: beyond it there is nothing to leave out
_TIMELESS = "rows have no time, left out"
Piece = dict[str, Block]  # by stream key; the streams of one pass over the file


@dataclass(slots=True)
class Findings:
    """What is wrong with a part of a source file, counted while it is read."""

    counts: Counter[str] = field(default_factory=Counter)
    last: dict[str, int] = field(default_factory=dict)  # stream -> its last stamp
    rows: Counter[str] = field(default_factory=Counter)  # by stream
    repeats: Counter[str] = field(default_factory=Counter)  # stamps as the one before, by stream
    finite: Counter[str] = field(default_factory=Counter)  # values that are numbers, by stream

    def check(self, key: str, block: Block) -> None:
        """Count cells without a number and stamps that do not grow."""
        self.counts[f"cells of '{key}' hold no number, kept as NaN"] += int(np.isnan(block.values).sum())
        self.finite[key] += int(np.isfinite(block.values).sum())
        self.counts[f"values of '{key}' are infinite, kept"] += int(np.isinf(block.values).sum())
        if len(block):
            steps = np.diff(block.stamp, prepend=self.last.get(key, int(block.stamp[0]) - 1))
            self.rows[key] += len(block)
            self.repeats[key] += int((steps == 0).sum())
            self.counts[f"time stamps of '{key}' lie before their predecessor, put in order"] += int((steps < 0).sum())
            self.last[key] = int(block.stamp[-1])

    def lines(self) -> tuple[str, ...]:
        """Return what was found, most frequent first."""
        repeats = {f"time stamps of '{key}' repeat the one before, kept": n for key, n in self.repeats.items()}
        found = Counter(self.counts | Counter(repeats))
        return tuple(f"{count} {what}" for what, count in found.most_common() if count)


def read_part(
    tables: MappingOf[str, Table], mapping: Mapping, part: Part, findings: Findings, attitudes: Sequence[Attitude] = ()
) -> Iterator[tuple[StreamMap, Block]]:
    """Yield the streams of one recording, from a table each, a piece at a time, several passes side by side in time.

    The first piece of each stream is empty: so all are known before the first sample. Raises RecordingError,
    at the end, for a stream without a sample.
    """
    streams = {stream.key: stream for stream in mapping.streams}
    for stream in mapping.streams:
        yield stream, Block(_NO_STAMPS, _NO_STAMPS, np.empty((0, len(stream.units))))
    shifts = {key: part.shift_of(key) for key in streams}
    passes = [
        _pieces(tables[shared[0].key], mapping, shared, shifts, findings, attitudes)
        for shared in _passes(mapping.streams, tables, shifts)
    ]
    start, end = -(1 << 63), (1 << 63) - 1
    if part.start_s > 0.0 or np.isfinite(part.end_s):
        heads = [next(pieces, {}) for pieces in passes]
        passes = [chain([head], pieces) for head, pieces in zip(heads, passes, strict=True)]
        stamps = [int(block.stamp[0]) for head in heads for block in head.values() if len(block)]
        first = min(stamps, default=0)
        start, end = (first + round(min(after, _LONGEST_S) * 1e9) for after in (part.start_s, part.end_s))

    empty = set(streams)
    arrivals = {key: Arrival(FAR_SLOW_NS) if key in SLOW else Arrival() for key in streams}
    for key, inside in chain(
        (
            (key, arrivals[key].push(_select(block, (block.stamp >= start) & (block.stamp < end))))
            for piece in _side_by_side(passes)
            for key, block in piece.items()
        ),
        ((key, last) for key, arrival in arrivals.items() if (last := arrival.flush()) is not None),
    ):
        _check_order(arrivals[key], tables[key], streams[key])
        findings.check(key, inside)
        if len(inside):
            empty.discard(key)
            yield streams[key], inside
    for table in {id(table): table for table in tables.values()}.values():
        for what, count in table.odd.items():
            findings.counts[what] += count
    for key, arrival in arrivals.items():
        if scattered := arrival.scattered:
            raise RecordingError(f"time of '{key}': {scattered}", where=str(tables[key].path), remedy=STAMP_EACH)
        findings.counts[f"time stamps of '{key}' do not fit where they stand, rows left out"] += arrival.odd
        findings.counts[f"time stamps of '{key}' lie far from all others, rows left out"] += arrival.lone
    for attitude in attitudes:
        findings.counts += attitude.conclude(str(tables["encoder"].path))
    for key in streams:
        table = tables[key]
        if findings.rows[key] >= _FEWEST and 2 * findings.repeats[key] >= findings.rows[key]:
            raise RecordingError(
                f"the times of '{key}' are too coarse: {findings.repeats[key]} of {findings.rows[key]} are those of "
                "the row before",
                where=str(table.path),
                remedy="give rate_Hz in the mapping's [time] if rows come at an even rate, else times of more digits",
            )
        if key in empty:
            raise RecordingError(
                f"no sample of '{key}' for recording '{part.stem}'", where=str(table.path), remedy=_why_empty(findings)
            )
        if not findings.finite[key]:
            raise RecordingError(
                f"no number of '{key}' for recording '{part.stem}': {findings.rows[key]} rows hold something else",
                where=str(table.path),
                remedy="check its columns, and, of a text file, delimiter, decimal and skip_rows in [text]",
            )


def _check_order(arrival: Arrival, table: Table, stream: StreamMap) -> None:
    """Raise RecordingError where time goes back for good."""
    if arrival.set_back is None:
        return
    number, _, by = arrival.set_back
    rate = stream.time.rate_Hz if stream.time is not None else None
    ticks = [1.0, 1e3, 1e6] if rate is None else [1e9 / rate]
    causes = {
        2.0**bits * tick * 1e-9: f"a counter of {bits} bits began anew" for bits in (16, 24, 32) for tick in ticks
    }
    near = [cause for span, cause in (_SET_BACK | causes).items() if abs(by * 1e-9 - span) < 1e-3 * span]
    raise RecordingError(
        f"time of '{stream.key}' goes back by {by * 1e-9:.6g} s at sample {number + 1}, and goes on from there: "
        + (near[0] if near else "the clock was set back, or the logger started again"),
        where=str(table.path),
        remedy="split the file there (of a text file, skip_rows and rows in the mapping's [text] take one part, and "
        "section in [[recording]] one where the names come again), and import each part as a recording of its own; or "
        "give rate_Hz",
    )


def _why_empty(findings: Findings) -> str:
    if findings.counts[_TIMELESS]:
        return (
            "no row has a time that is a number (with unit = 'datetime': a date as ISO 8601 writes it, such as "
            "2026-11-29T23:59:00Z): check [time] and, of a text file, delimiter, decimal, units_row and skip_rows in "
            "[text]; `kbs-process import --describe` shows what the columns hold"
        )
    return "check start_s and end_s (s from the file's first sample), and that the file is whole"


def _side_by_side(passes: Sequence[Iterator[Piece]]) -> Iterator[Piece]:
    """Yield the pieces of all passes, the next from the one that is furthest behind in time."""
    reached = dict.fromkeys(range(len(passes)), -(1 << 63))
    while reached:
        behind = min(reached, key=reached.__getitem__)
        piece = next(passes[behind], None)
        if piece is None:
            del reached[behind]
            continue
        yield piece
        reached[behind] = max([reached[behind], *(int(b.stamp[-1]) for b in piece.values() if len(b))])


def _passes(
    streams: Sequence[StreamMap], tables: MappingOf[str, Table], shifts: MappingOf[str, float]
) -> list[list[StreamMap]]:
    """Group streams that share file and time: the file is read once for each group."""

    def clock(stream: StreamMap) -> tuple[object, ...]:
        return stream.time, id(tables[stream.key]), shifts.get(stream.key)

    passes: list[list[StreamMap]] = []
    for stream in streams:
        shared = next((group for group in passes if stream.time and clock(group[0]) == clock(stream)), None)
        if shared is None:
            passes.append([stream])
        else:
            shared.append(stream)
    return passes


def _pieces(
    table: Table,
    mapping: Mapping,
    streams: Sequence[StreamMap],
    shifts: MappingOf[str, float],
    findings: Findings,
    attitudes: Sequence[Attitude],
) -> Iterator[Piece]:
    time = streams[0].time
    shift = round(shifts.get(streams[0].key, 0.0) * 1e9)  # ns
    channels = [channel for stream in streams for channel in stream.channels]
    turning = [one for one in attitudes if any(one.orientation in stream.orientations for stream in streams)]
    parts = [[find_column(table, column).name for column in one.orientation.columns] for one in turning]
    columns = [find_column(table, channel.column) for channel in channels]
    if time is None:
        timed = [*columns, *(find_column(table, name) for name in chain(*parts))]
        clocks = [column.clock for column in timed]
        if not all(clocks):
            why = "; ".join(one for one in table.left_out if ": time: " in one)
            raise RecordingError(
                f"'{timed[clocks.index('')].name}' comes without a time of its own" + (f" ({why})" if why else ""),
                where=str(table.path),
                remedy="say in the mapping's [time] which column holds it, or give rate_Hz",
            )
        written = {column.written for column in timed}
    else:
        written = {""}
        clock = None if time.column is None else find_column(table, time.column)
        clocks = [clock.name] if clock else []
        if clock and time.rate_Hz is None and clock.unit != "datetime":
            _check_unit(table, clock, time.unit, 1.0, findings)
    for channel, column in zip(channels, columns, strict=True):
        _check_unit(table, column, channel.given, channel.scale, findings)
    recorder = written.pop() if len(written) == 1 else ""
    others = [*clocks, *([recorder] if recorder else [])]
    wanted = list(dict.fromkeys([*(column.name for column in columns), *chain(*parts), *others]))
    carry: dict[str, float] = {}
    rows = 0
    for cells in table.chunks(wanted):
        named = dict(zip(wanted, cells, strict=True))
        _check_lengths(table, named)
        stamp, known = _stamps(table, time, clocks, named, rows)
        stamp = stamp + shift
        log = nanoseconds(named[recorder], Time.model_construct(), recorder)[0] + shift if recorder else stamp
        rows += len(stamp)
        findings.counts[_TIMELESS] += int((~known).sum())
        again = np.zeros(len(stamp), dtype=np.bool_)
        again[1:] = np.logical_and.reduce([x[1:] == x[:-1] for x in (stamp, *named.values())])
        findings.counts["rows are those before them again, time and all, left out"] += int((again & known).sum())
        values = {
            channel.field: _si(named[column.name], channel, carry)
            for channel, column in zip(channels, columns, strict=True)
        }
        for attitude, names in zip(turning, parts, strict=True):
            cells_of = np.column_stack([numbers(named[name]) for name in names])
            values |= zip(attitude.orientation.fields, attitude.angles(cells_of, str(table.path)).T, strict=True)
        if mapping.turn and any(stream.key == "wrench" for stream in streams):
            _turn(values, mapping.turn)
        matrix = {stream.key: np.column_stack([values[field] for field in stream.units]) for stream in streams}
        yield {key: _select(Block(stamp, log, columns), known & ~again) for key, columns in matrix.items()}


def _check_unit(table: Table, column: Column, given: str, scale: float, findings: Findings) -> None:
    """Raise RecordingError where the file states another unit than the mapping; report what cannot be compared."""
    stated = column.unit or bracketed(column.name)
    same = agree(stated, given) if stated else True
    what = f"'{column.name}' is in '{stated}' as the file states it, in '{given}' as the mapping does"
    if same is False and abs(scale) == 1.0:
        raise RecordingError(what, where=str(table.path), remedy="correct the unit where it is wrong")
    if not same:
        findings.counts[f"column whose unit cannot be compared: {what}"] = 1


def _stamps(
    table: Table, time: Time | None, clocks: Sequence[str], named: dict[str, Cells], rows: int
) -> tuple[Stamps, Mask]:
    if time is not None and not clocks:
        count = len(next(iter(named.values())))
        return nanoseconds(np.arange(rows, rows + count), time, str(table.path))
    stamp, known = nanoseconds(named[clocks[0]], time or Time.model_construct(), f"{table.path}: {clocks[0]}")
    for clock in clocks[1:]:
        if not np.array_equal(named[clock], named[clocks[0]]):
            raise RecordingError(
                f"'{clocks[0]}' and '{clock}' differ: the channels of one stream must be sampled together",
                where=str(table.path),
                remedy="give a common [time], or import channels of one clock",
            )
    return stamp, known


def _check_lengths(table: Table, named: dict[str, Cells]) -> None:
    first, *rest = named
    for name in rest:
        if len(named[name]) != len(named[first]):
            raise RecordingError(
                f"'{first}' and '{name}' are not equally long",
                where=str(table.path),
                remedy="channels of one stream, and its time, must be; give other streams a [time] of their own",
            )


def _si(cells: Cells, channel: Channel, carry: dict[str, float]) -> Array:
    """Return a channel in SI units; `carry` holds the last angle of those that are unwrapped."""
    values = numbers(cells)
    if channel.gain != 1.0 or channel.offset != 0.0:  # not a sum with zero, which would change -0.0
        values = values * channel.gain + channel.offset
    if channel.turn:
        finite = np.isfinite(values)
        if finite.any():
            known = values[finite]
            before = carry.get(channel.field, float(known[0]))
            values[finite] = np.unwrap(np.concatenate(([before], known)), period=channel.turn)[1:]
            carry[channel.field] = float(values[finite][-1])
    return values


def _turn(values: dict[str, Array], turn: Turn) -> None:
    """Turn forces and moments by factor * q about the axis k: v cos + (k x v) sin + k (k . v) (1 - cos)."""
    angle = (turn.factor * values[f"position[{turn.joint}]"])[:, None]
    k = np.asarray(turn.axis)
    for kind in ("force", "torque"):
        fields = [f"wrench.{kind}.{axis}" for axis in "xyz"]
        if fields[0] not in values:
            continue
        v = np.column_stack([values[field] for field in fields])
        along = (v @ k)[:, None] * k
        turned = (v - along) * np.cos(angle) + np.cross(k, v) * np.sin(angle) + along
        values.update(zip(fields, turned.T, strict=True))


def _select(block: Block, mask: Mask) -> Block:
    if mask.all():
        return block
    return Block(block.stamp[mask], block.log[mask], block.values[mask])
