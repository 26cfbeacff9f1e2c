"""The beginning of a campaign from nothing but recordings: what they tell is put in, all else is a question."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field
from itertools import combinations, product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import msgspec
import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from msgspec.structs import replace

from kbs_process.campaign.documents import QUESTION, quoted, read, shown
from kbs_process.campaign.units import dimension, to_si
from kbs_process.campaign.writing.parameter_files import value_text
from kbs_process.errors import ConfigError, KbsError, RecordingError
from kbs_process.recordings.formats import Text, format_named
from kbs_process.recordings.formats.text import TextTable
from kbs_process.recordings.open_table import open_table
from kbs_process.recordings.tables import Table
from kbs_process.results.store import writing
from kbs_process.signals.records import WRENCH_CHANNELS, Array
from kbs_process.studies.convert.clock import date_formats, nanoseconds, numbers
from kbs_process.studies.convert.description import prepare
from kbs_process.studies.convert.mapping import load_mapping
from kbs_process.studies.convert.mapping_file import Time
from kbs_process.studies.convert.naming import Meaning, by_channel, meaning, rotation, runs_of
from kbs_process.studies.convert.orientation import elements, written
from kbs_process.studies.convert.shift import find_shift

MAPPING_FILE = "mapping.toml"
_PREAMBLE = 40  # lines above a table that are looked through
_YEAR_NS = 31_536_000 * 10**9  # a file's own times within a year of 1970 count from the file's begin
_OSCILLATOR = 3e-4  # by which two clocks' rates may differ; less is part of the shift's sigma
_APART = 5.0  # sigmas: clocks whose shift changes by more from half to half run at different rates
_ENCODINGS = (Text().encoding, "cp1252")  # the latter is what Windows writes in Western Europe
_MOST = 1e100  # a greater number is no reading
_KEPT = 4096  # rows of a piece that are kept, as averages
_WORDS = 200  # dates, by which their format is known
_RATES = [digit * 10.0**power for power in range(-2, 6) for digit in (1, 2, 5)]


@dataclass(slots=True)
class Log:
    """One file: its columns, and what of their contents is needed. Times are s of its own clock."""

    path: Path
    text: Text
    columns: list[Meaning]
    section: int | None = None  # of a text that has several
    dated: bool = False
    formats: list[str] = field(default_factory=list)  # of its dates: one, or several that may be meant
    clocked: bool = False  # by the file itself
    times: dict[str, list[Array]] = field(default_factory=dict)  # by stream
    values: dict[str, list[Array]] = field(default_factory=dict)  # by column, as the file has them, averaged with times
    noise: dict[str, float] = field(default_factory=dict)  # by column, rms of a reading
    step: dict[str, float] = field(default_factory=dict)  # by column, least step of readings
    rates: dict[str, float] = field(default_factory=dict)  # by stream, Hz; 0: not known
    wraps: set[str] = field(default_factory=set)  # columns of angles that begin again at every turn
    left_out: tuple[str, ...] = ()  # what the file holds besides, and why it has no column

    def of(self, stream: str) -> list[Meaning]:
        """Return the columns of a stream."""
        return [one for one in self.columns if one.stream == stream]

    @property
    def motion(self) -> str:
        """The stream that tells how joints move."""
        return "encoder" if self.of("encoder") or not rotation(self.of("orientation")) else "orientation"

    def samples(self, stream: str) -> tuple[Array, Array]:
        """Return times (n,), s, and the columns of a stream (n, c), in SI where the unit is known, without gaps."""
        t = np.concatenate(self.times[stream])
        columns = [np.concatenate(self.values[one.column]) * (to_si(one.unit) or 1.0) for one in self.of(stream)]
        values = np.stack(columns, axis=1)
        values = elements(values) if stream == "orientation" else values
        good = np.isfinite(t) & np.isfinite(values).all(axis=1)
        return t[good], values[good]

    @property
    def name(self) -> str:
        """The file, and which section of it."""
        return self.path.name if self.section is None else f"{self.path.stem}_section{self.section}{self.path.suffix}"

    @property
    def kind(self) -> tuple[object, ...]:
        """What files of one logger share."""
        return self.path.suffix, self.text, tuple(self.columns)


def begin(target: Path, files: Sequence[Path]) -> Iterator[str]:
    """Make a folder with campaign.toml, rig.toml and mapping.toml out of recordings; yield what was found, as lines.

    Raises RecordingError where a file cannot be read, ConfigError where files do not belong together, OutputError where
    the folder holds something already.
    """
    logs = [log for path in dict.fromkeys(files) for log in _logs(path)]
    loads = [log for log in logs if log.of("wrench")] or logs
    angles = [log for log in logs if log.of(log.motion)] or loads
    for group, what in ((loads, "wrench"), (angles, "angles")):
        if odd := next((log for log in group if log.kind != group[0].kind), None):
            raise ConfigError(
                f"'{odd.path.name}' has the {what} in other columns than '{group[0].path.name}'",
                remedy="give the files of one rig and set-up; export those that differ anew",
            )
    facts = _facts(loads, angles)
    environment = Environment(
        loader=PackageLoader("kbs_process.studies.convert", "prose"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters["quoted"] = quoted
    with writing(target, MAPPING_FILE) as folder:
        for name in ("campaign", "rig", "mapping"):
            text = environment.get_template(f"{name}.j2").render(facts | {"name": target.absolute().name})
            (folder / f"{name}.toml").write_text(text, encoding="utf-8")
    for log in (loads[0], *angles[:1]) if angles[0] is not loads[0] else loads[:1]:
        yield from _listing(log)
    for run in facts["runs"]:
        part = f", section {run['section']}" if run["section"] else ""
        yield f"{run['name']}: {run['source']}{part}" + (f", {run['other']}; {run['told']}" if run["other"] else "")
    used = {run[key] for run in facts["runs"] for key in ("source", "other")}
    yield from (f"not used: {log.path.name}" for log in logs if log.path.name not in used)


def check_description(folder: Path) -> Iterator[str]:
    """Check what was begun; yield what to do next. Raises ConfigError that lists every value that is still missing."""
    faults: list[KbsError] = []
    for path in sorted(folder.glob("*.toml")):
        try:
            read(path, role="the description", remedy="begin again")
        except ConfigError as error:
            faults += error.each or [error]
    if faults:
        raise ConfigError(f"{len(faults)} values are still to be put in", where=shown(folder), each=faults)
    mapping = load_mapping(folder / MAPPING_FILE)
    with TemporaryDirectory() as place:
        campaign = prepare(mapping, Path(place))
    yield f"{campaign.name}: the description is complete; {len(mapping.parts)} recordings are to be imported"
    command = f"kbs-process import {shown(mapping.path)} FOLDER campaigns/{campaign.name}"
    yield f"  -> {command}; FOLDER holds the recordings"


def _logs(path: Path) -> Iterator[Log]:
    """Yield the logs of a file: one, or one a section."""
    table, text = _opened(path)
    count = table.sections() if isinstance(table, TextTable) else 1
    for section in range(1, count + 1) if count > 1 else (None,):
        part = open_table(path, None, replace(text, section=section)) if section else table
        clocks = {name for column in part.columns for name in (column.clock, column.written)}
        columns = [meaning(column) for column in part.columns if column.name not in clocks]
        yield _read(part, Log(path, text, columns, section))


def _read(table: Table, log: Log) -> Log:
    """Read the wrench and what tells the motion, each by its own clock, those of one clock together."""
    clocks = {column.name: column.clock for column in table.columns}
    together: dict[str, list[str]] = {}  # streams by clock
    for stream in [one for one in ("wrench", log.motion) if log.of(one)] or ["wrench"]:
        own = [clocks[one.column] for one in log.of(stream)] or list(clocks.values())
        together.setdefault(next(filter(None, own), ""), []).append(stream)
    log.clocked, log.left_out = all(together), table.left_out
    for clock, streams in together.items():
        _read_together(table, log, clock, streams)
    return log


def _read_together(table: Table, log: Log, clock: str, streams: Sequence[str]) -> None:
    used = [one.column for stream in streams for one in log.of(stream)]
    stamp = [] if clock else log.of("time")[:1]
    wanted = list(dict.fromkeys([*used, *([clock] if clock else ()), *(one.column for one in stamp)]))
    known = False
    for cells in table.chunks(wanted):
        named = dict(zip(wanted, cells, strict=True))
        rows = min(len(named[name]) for name in wanted) if wanted else 0
        block = max(1, rows // _KEPT)
        whole = rows // block * block
        values = {name: np.where(np.abs(x := numbers(named[name][:rows])) < _MOST, x, np.nan) for name in used}
        first, known = not known and rows > 0, known or rows > 0
        if first:
            turns = {
                one.column: 2.0 * np.pi / to_si(one.unit) for one in log.of("encoder") if dimension(one.unit) == "angle"
            }
            log.wraps |= {
                name
                for name, turn in turns.items()
                if name in values and np.any(np.abs(np.diff(values[name])) > 0.5 * turn)
            }
            log.noise |= {name: _noise(x) for name, x in values.items()}
            log.step |= {name: _step(x) for name, x in values.items()}
        if (seconds := _seconds(log, named, clock, stamp, rows)) is not None:
            for stream in streams:
                if first and rows > 2:
                    log.rates[stream] = 1.0 / max(float(np.nanmedian(np.diff(seconds))), 1e-9)
                log.times.setdefault(stream, []).append(seconds[:whole].reshape(-1, block).mean(axis=1))
            for name, x in values.items():
                log.values.setdefault(name, []).append(x[:whole].reshape(-1, block).mean(axis=1))


def _opened(path: Path) -> tuple[Table, Text]:
    """Open a file; of a text, look for where its table begins, for a line of units, and for its decimal mark."""
    if path.suffix.lower() not in format_named("text").suffixes:
        return open_table(path), Text()
    failed: RecordingError | None = None
    ways = (
        Text(skip_rows=skip, units_row=units, decimal=decimal, encoding=encoding)  # type: ignore[arg-type]
        for encoding, skip, units, decimal in product(_ENCODINGS, range(_PREAMBLE), (False, True), (".", ","))
    )
    for text in ways:
        try:
            table = open_table(path, None, text)
            first = next(iter(table.chunks([column.name for column in table.columns])))
        except (RecordingError, StopIteration) as error:
            failed = failed or (error if isinstance(error, RecordingError) else None)
            continue
        good = sum(one.dtype.kind == "M" or bool(np.isfinite(numbers(one)[:100]).mean() > 0.5) for one in first)
        if len(first) > 1 and good >= 0.5 * len(first):
            return table, text
    raise failed or RecordingError(
        "no table of numbers is found", where=str(path), remedy="see `kbs-process import --describe`"
    )


def _seconds(log: Log, named: dict[str, Any], clock: str, stamp: list[Meaning], rows: int) -> Array | None:
    """Return the times of rows in s; None where nothing tells them."""
    if not clock and not stamp:
        return None
    cells, unit = named[clock or stamp[0].column][:rows], "s" if clock else stamp[0].unit
    if not clock:
        if cells.dtype.kind == "M" or (cells.dtype.kind not in "iuf" and not np.isfinite(numbers(cells[:10])).any()):
            words = (
                [str(one).strip() for one in cells[:: max(1, len(cells) // _WORDS)].tolist()]
                if cells.dtype.kind != "M"
                else []
            )
            unit, log.dated, log.formats = "datetime", True, log.formats or date_formats(words)
            log.columns = [Meaning(one.column, "time", unit=unit) if one == stamp[0] else one for one in log.columns]
        if unit not in ("s", "ms", "us", "ns", "min", "datetime"):
            return None
    time = Time.model_construct(unit=unit, format=next(iter(log.formats), None))
    ns, known = nanoseconds(cells, time, str(log.path))
    if not known.any():
        log.columns = [Meaning(one.column, "time") if one.stream == "time" else one for one in log.columns]
        return None
    least = _YEAR_NS if clock else 10**18  # a number of a column may be large
    log.dated = log.dated or bool(known.any() and ns[known].min() > least)  # counted from 1970
    return np.where(known, ns * 1e-9, np.nan)


def _noise(x: Array) -> float:
    """Return the rms of white noise, in the file's unit: second differences see neither value nor slope."""
    bends = np.diff(x[np.isfinite(x)], 2)
    return float(f"{np.sqrt((bends**2).mean() / 6.0):.2g}") if len(bends) else 0.0


def _step(x: Array) -> float:
    """Return the least step of readings, in the file's unit, 0 where it is finer than a millionth of their range."""
    values = np.unique(x[np.isfinite(x)])
    steps = np.diff(values)[np.diff(values) > 1e-6 * np.ptp(values)] if len(values) > 1 else np.empty(0)
    return float(f"{steps.min():.4g}") if len(steps) else 0.0


def _facts(loads: Sequence[Log], angles: Sequence[Log]) -> dict[str, Any]:
    """Return what the files tell, as the templates ask for it."""
    load, angle = loads[0], angles[0]
    wrench = by_channel(load.of("wrench")) or {c: Meaning(QUESTION, "wrench", c) for c in WRENCH_CHANNELS}
    channels = [channel for channel in WRENCH_CHANNELS if channel in wrench]
    joints = by_channel(angle.of("encoder")) or {"joint": Meaning(QUESTION, "encoder", "joint")}
    known = all(wrench[channel].unit != QUESTION for channel in channels)
    slowest = min(load.rates.get("wrench", 0.0), angle.rates.get(angle.motion, 0.0))
    streams = {"wrench": [wrench[c] for c in channels], angle.motion: [*joints.values()]}
    logs = {"": load, ".encoder": angle} if load is not angle else {"": load}
    return {
        "rate": max((rate for rate in _RATES if rate <= slowest / 2.0), default=None) if slowest else None,
        "slowest": slowest,
        "channels": channels,
        "noise": [_three(load.noise, wrench[c]) for c in channels] if known else None,
        "resolution": [_three(load.step, wrench[c]) for c in channels] if known else None,
        "file": load.path.name,
        "joints": [
            {
                "name": name,
                "sliding": dimension(one.unit) == "length",
                "unit": one.unit,
                "step": angle.step[one.column] if one.unit != QUESTION else None,
                "file": angle.path.name,
            }
            for name, one in joints.items()
        ],
        "clocks": {key: _clock(log) for key, log in logs.items()},
        "texts": {
            key: "\n".join(_text(log)) for key, log in logs.items() if any(_text(one) for one in (log, logs[""]))
        },
        "streams": {
            key: [
                asdict(one) | {"asked": QUESTION in (one.column, one.unit), "wraps": one.column in angle.wraps}
                for one in rows
            ]
            for key, rows in streams.items()
        },
        "orientation": written([quoted(column) for column in rotation(angle.of("orientation"))]),
        "numbered": ", ".join(one.column for one in angle.of("orientation")),
        "runs": _runs(loads, angles if load is not angle else ()),
    }


def _three(values: dict[str, float], one: Meaning) -> float:
    """Return a column's value in SI, to three digits."""
    return float(f"{values[one.column] * to_si(one.unit):.3g}")


def _clock(log: Log) -> str:
    """Return the keys of [time]."""
    if log.clocked:
        return "# the file has its own"
    if stamp := log.of("time"):
        unit = quoted(stamp[0].unit) + ("  # of the times" if stamp[0].unit == QUESTION else "")
        return "\n".join([f"column = {quoted(stamp[0].column)}", f"unit = {unit}", *_format(log)])
    return 'rate_Hz = "?"  # rows a second: no column is known for a time'


def _format(log: Log) -> list[str]:
    """Return the key that says how dates are written, a question where day and month may be either way."""
    if len(log.formats) > 1:
        return [f'format = "?"  # day or month first? {" or ".join(map(quoted, log.formats))}']
    return [f"format = {quoted(one)}" for one in log.formats]


def _text(log: Log) -> list[str]:
    """Return the keys of [text]."""
    given, usual = msgspec.to_builtins(log.text), msgspec.to_builtins(Text())
    return [f"{key} = {value_text(value)}" for key, value in given.items() if value != usual[key]]


def _runs(loads: Sequence[Log], angles: Sequence[Log]) -> list[dict[str, Any]]:
    """Return the recordings: a file each, or a pair of files of two loggers whose names differ in one part alone.

    The sections of a log have no names: they are taken in the order of the other logger's files.
    """
    named, others = (dict(zip(runs_of([log.name for log in group]), group, strict=True)) for group in (loads, angles))
    in_order = len(loads) == 1 or any(log.section for log in (*loads, *angles))
    if in_order and len(loads) == len(angles) and not named.keys() & others.keys():
        others = dict(zip(named, angles, strict=True))
    runs = []
    for name, log in named.items():
        other = others.get(name)
        shift, told = _shift(log, other) if other else ("", "no file of angles has such a name" if angles else "")
        file = other.path.name if other else QUESTION if angles else ""
        section = log.section or (other.section if other else None)
        run = {"name": name, "source": log.path.name, "section": section, "other": file, "shift": shift, "told": told}
        runs.append(run)
    return runs


def _shift(load: Log, angle: Log) -> tuple[str, str]:
    """Return the keys that say how two clocks stand to each other, and the same in words."""
    if load.dated and angle.dated:
        return "# both files have dates: their clocks are taken to agree", "both have dates"
    turned = angle.motion == "orientation"
    joints = [] if turned else angle.of("encoder")
    asked_of = rotation(angle.of("orientation")) if turned else [one.unit for one in joints]
    found, asked = None, "motion and times do not tell it"
    if "wrench" in load.times and angle.motion in angle.times and QUESTION not in asked_of:
        (t, wrench), (t_angle, q) = load.samples("wrench"), angle.samples(angle.motion)
        turns = [dimension(one.unit) == "angle" for one in joints]
        found = find_shift(t, wrench, t_angle, q, turns)
        halves = []
        if found:
            at = t + found[0]
            both = np.flatnonzero((at >= t_angle[0]) & (at <= t_angle[-1]))  # rows that both loggers saw
            halves = [both[: len(both) // 2], both[len(both) // 2 :]]
        parts = [one for half in halves if (one := find_shift(t[half], wrench[half], t_angle, q, turns))]
        for one, other in combinations([found, *parts] if found else [], 2):
            by = abs(one[0] - other[0])
            if found and by <= _OSCILLATOR * np.ptp(t) / 2.0:  # what is between two halves
                found = found[0], max(found[1], by / 2.0)
            elif by > _APART * np.hypot(one[1], other[1]):
                found, asked = None, f"it is {one[0]:.4f} s in one part, {other[0]:.4f} s in another"
    if found is None:
        told = f"how their clocks stand to each other is not known: {asked}"
        return f'shift_s = {{ wrench = "?" }}  # s, added to the times of the wrench: {asked}', told
    shift, sigma = found
    later, earlier = max(shift, 0.0), max(-shift, 0.0)  # what is added to the times of the wrench, of the angles
    starts, ends = ((t[at] + later, t_angle[at] + earlier) for at in (0, -1))
    who = "wrench" if shift >= 0.0 else "encoder"
    return (
        f"shift_s = {{ {who} = {abs(shift):.4f} }}  # found from the motion: check it\n"
        f"shift_sigma_s = {sigma:.1g}  # its standard deviation\n"
        f"start_s = {max(starts) - min(starts):.3f}  # where both loggers ran\n"
        f"end_s = {min(ends) - min(starts):.3f}"
    ), f"{abs(shift):.4f} s (+- {sigma:.1g} s, from the motion) are added to the times of {who}"


def _listing(log: Log) -> Iterator[str]:
    """Yield the table of a file's columns: what each was taken for."""
    rate = "".join(f", {one:.5g} Hz" for one in dict.fromkeys(log.rates.values()))
    told = "".join(f", {line}" for line in _text(log))
    yield f"{log.path.name}{rate}{told}"
    width = max(len(one.column) for one in log.columns)
    for one in log.columns:
        use = f"{one.stream} {one.channel}".strip() + f" in {one.unit}" if one.stream else "not used"
        again = ", begins again at every turn" if one.column in log.wraps else ""
        yield f"  {one.column:<{width}}  {use}{again}"
    yield from (f"  left out: {one}" for one in log.left_out)
