"""What a results folder holds besides results.json and the report: tables and processed recordings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from kbs_process.recordings.mcap.messages.encoding import OutStream
from kbs_process.recordings.mcap.writer import write_pieces
from kbs_process.reduction.analysis import Analysis
from kbs_process.results.tables import TableWriter, write_table
from kbs_process.signals.grid import crop
from kbs_process.signals.records import WRENCH_CHANNELS, Signal
from kbs_process.stages.repeats import commanded
from kbs_process.studies.correlate import instruments, orders
from kbs_process.studies.correlate.transducer import Study

_PIECE = 2**13  # samples that are written at a time


def write_tables(
    folder: Path,
    analyses: Sequence[Analysis],
    on_transducer: Study | None,
    by_angle: Sequence[orders.Study],
    by_instrument: Sequence[instruments.Beside],
) -> None:
    """Write the tables of every stage, and the processed signals as MCAP."""
    for analysis in analyses:
        _tables(TableWriter(folder, analysis.entry.name), analysis)
        _recording(folder / "processed", analysis)
    if on_transducer is not None:
        _curves(folder / "tables" / "transducer", on_transducer)
    for one in by_angle:
        name = one.findings.recording
        for kind, (columns, units) in orders.tables_of(one).items():
            path = folder / "tables" / "orders" / f"{name}.{one.findings.joint}{kind}.parquet"
            write_table(path, columns, units, frame="T", recording=name)
    for beside in by_instrument:
        path = folder / "tables" / "instruments" / f"{beside.recording}.{beside.stream}.parquet"
        write_table(path, beside.columns(), instruments.units(beside), frame=beside.stream, recording=beside.recording)


def _curves(folder: Path, found: Study) -> None:
    name = found.findings.recording
    for kind, columns, unit in (("gain", found.gains, "1"), ("spectrum", found.spectra, "(N m)^2/Hz")):
        if columns:
            units = {column: "Hz" if column == "f" else unit for column in columns}
            write_table(folder / f"{name}.{kind}.parquet", columns, units, frame="T", recording=name)


def _tables(writer: TableWriter, analysis: Analysis) -> None:
    run, loads = analysis.run, analysis.run.loads
    assert loads is not None
    joints = {
        kind: signal
        for kind, signal in (("angle", run.angle), ("rate", run.rate), ("command", commanded(run)))
        if signal is not None
    }
    writer.aligned(analysis.raw, joints)
    writer.gravity(loads, analysis.static.wrench, analysis.residual)
    units = dict(zip(loads.channels, loads.units, strict=True))
    if run.envelope is not None:
        whole = loads if run.wrench is None else run.wrench  # what has an envelope
        writer.envelope(run.envelope, whole.channels, whole.units)
    if run.spectrum is not None:
        writer.spectrum(run.spectrum, None if analysis.predicted is None else analysis.predicted.spectrum, units)
    for (frame, band), pair in analysis.pairs.items():
        writer.band("spacecraft" if frame == "S" else "bands", band, pair.measured, pair.predicted)


def _recording(folder: Path, analysis: Analysis) -> None:
    """One MCAP file a recording: every band and frame, measured and predicted, as any viewer opens it."""
    signals = [
        (_streams, f"/{kind}/{band}", signal)
        for (_, band), pair in sorted(analysis.pairs.items())
        for kind, signal in (("measured", pair.measured), ("predicted", pair.predicted))
    ]
    signals.append((_streams, "/gravity", analysis.static.wrench))
    signals += [(_joints, "/encoder", analysis.run.angle), (_joints, "/command", commanded(analysis.run))]
    known = [(make, topic, signal) for make, topic, signal in signals if signal is not None]
    pieces = (
        piece
        for start in range(0, max(len(signal) for _, _, signal in known), _PIECE)
        for make, topic, signal in known
        for piece in make(topic, crop(signal, start, _PIECE), analysis.run.epoch_ns)
    )
    folder.mkdir(exist_ok=True)
    write_pieces(folder / f"{analysis.entry.name}.mcap", pieces)


def _streams(topic: str, signal: Signal, epoch_ns: int) -> Iterator[OutStream]:
    """A wrench of all six components, those without a channel not a number; and the efforts of joints."""
    stamp = epoch_ns + np.rint(signal.t * 1e9).astype(np.int64)
    components = [channel for channel in signal.channels if channel in WRENCH_CHANNELS]
    if components:
        wrench = np.full((len(signal), len(WRENCH_CHANNELS)), np.nan)
        for channel in components:
            wrench[:, WRENCH_CHANNELS.index(channel)] = signal.column(channel)
        frame = "spacecraft" if signal.frame == "S" else "transducer"
        yield OutStream(
            topic=f"{topic}/{frame}/wrench", kind="wrench", stamp=stamp, log=stamp, values=wrench, frame=frame
        )
    efforts = [channel for channel in signal.channels if channel not in WRENCH_CHANNELS]
    if efforts:
        unknown = np.full((len(signal), 2 * len(efforts)), np.nan)  # positions and velocities
        values = np.column_stack([unknown, *(signal.column(channel) for channel in efforts)])
        names = tuple(channel.removesuffix(".effort") for channel in efforts)
        yield OutStream(topic=f"{topic}/joints", kind="joints", stamp=stamp, log=stamp, values=values, names=names)


def _joints(topic: str, signal: Signal, epoch_ns: int) -> Iterator[OutStream]:
    """Angles of the joints that a signal has."""
    stamp = epoch_ns + np.rint(signal.t * 1e9).astype(np.int64)
    yield OutStream(topic=topic, kind="joints", stamp=stamp, log=stamp, values=signal.values, names=signal.channels)
