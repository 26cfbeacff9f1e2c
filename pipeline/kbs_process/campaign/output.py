"""Everything that a results folder holds besides the report: tables, processed recordings, results.json."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import msgspec
import numpy as np

from kbs_process.campaign.analysis import Analysis
from kbs_process.campaign.config import Campaign
from kbs_process.campaign.tables import TableWriter, write_table
from kbs_process.campaign.transducer import Study
from kbs_process.ingest import OutStream, write_mcap
from kbs_process.report import results
from kbs_process.signals.records import WRENCH_CHANNELS, Signal
from kbs_process.stages.repeats import commanded


def write_results(
    folder: Path,
    campaign: Campaign,
    analyses: Sequence[Analysis],
    summary: results.Results,
    on_transducer: Study | None,
) -> None:
    """Write results.json, the tables of every stage, and the processed signals as MCAP."""
    for analysis in analyses:
        _tables(TableWriter(folder, analysis.entry.name), analysis)
        _recording(folder / "processed", analysis)
    if on_transducer is not None:
        _curves(folder / "tables" / "transducer", on_transducer)
        summary = msgspec.structs.replace(summary, transducer=on_transducer.findings)
    (folder / "results.json").write_bytes(results.encode(summary))


def _curves(folder: Path, found: Study) -> None:
    name = found.findings.recording
    for kind, columns, unit in (("gain", found.gains, "1"), ("spectrum", found.spectra, "(N m)^2/Hz")):
        if columns:
            units = {column: "Hz" if column == "f" else unit for column in columns}
            write_table(folder / f"{name}.{kind}.parquet", columns, units, frame="T", recording=name)


def _tables(writer: TableWriter, analysis: Analysis) -> None:
    run = analysis.run
    assert run.wrench is not None
    joints = {
        kind: signal
        for kind, signal in (("angle", run.angle), ("rate", run.rate), ("command", commanded(run)))
        if signal is not None
    }
    writer.aligned(analysis.raw, joints)
    writer.gravity(run.wrench, analysis.static.wrench, analysis.residual)
    units = dict(zip(run.wrench.channels, run.wrench.units, strict=True))
    if run.envelope is not None:
        writer.envelope(run.envelope, run.wrench.channels, run.wrench.units)
    if run.spectrum is not None:
        writer.spectrum(
            run.spectrum, None if analysis.predicted is None else analysis.predicted.spectrum, units
        )
    for (frame, band), pair in analysis.pairs.items():
        writer.band("spacecraft" if frame == "S" else "bands", band, pair.measured, pair.predicted)


def _recording(folder: Path, analysis: Analysis) -> None:
    """One MCAP file a recording: every band and frame, measured and predicted, as any viewer opens it."""
    streams = []
    for (frame, band), pair in sorted(analysis.pairs.items()):
        for kind, signal in (("measured", pair.measured), ("predicted", pair.predicted)):
            if signal is not None:
                topic = f"/{kind}/{band}/{'spacecraft' if frame == 'S' else 'transducer'}/wrench"
                streams.append(_stream(topic, signal, analysis.run.epoch_ns))
    streams.append(_stream("/gravity/transducer/wrench", analysis.static.wrench, analysis.run.epoch_ns))
    for topic, joints in (("/encoder", analysis.run.angle), ("/command", commanded(analysis.run))):
        if joints is not None:
            streams.append(_joints(topic, joints, analysis.run.epoch_ns))
    folder.mkdir(exist_ok=True)
    write_mcap(folder / f"{analysis.entry.name}.mcap", streams)


def _stream(topic: str, signal: Signal, epoch_ns: int) -> OutStream:
    """A wrench of all six components; those without a channel are not a number."""
    values = np.full((len(signal), len(WRENCH_CHANNELS)), np.nan)
    values[:, [WRENCH_CHANNELS.index(channel) for channel in signal.channels]] = signal.values
    stamp = epoch_ns + np.rint(signal.t * 1e9).astype(np.int64)
    frame = "spacecraft" if signal.frame == "S" else "transducer"
    return OutStream(topic=topic, kind="wrench", stamp=stamp, log=stamp, values=values, frame=frame)


def _joints(topic: str, signal: Signal, epoch_ns: int) -> OutStream:
    """Angles of the joints that a signal has."""
    stamp = epoch_ns + np.rint(signal.t * 1e9).astype(np.int64)
    return OutStream(
        topic=topic, kind="joints", stamp=stamp, log=stamp, values=signal.values, names=signal.channels
    )
