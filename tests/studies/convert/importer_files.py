"""A small campaign to import into, and its signals written in every format by that format's own library."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from kbs_process.campaign.load import load_campaign
from kbs_process.recordings.mcap.source import open_recording
from kbs_process.recordings.mcap.streams import Stream
from kbs_process.signals.records import Array, Stamps

CAMPAIGN = """
schema = 1
name = "wheel"
title = "A wheel"  # kept, comment and all
drive = "motion"
bands = { high_pass_Hz = 0.0, low_pass_Hz = [2.0], working_rate_Hz = 20.0 }
topics = { wrench = "/transducer/wrench", encoder = "/encoder" }
parameters = { files = ["parameters/rig.toml"] }

[[recording]]  # of another day: replaced
file = "recordings/old.mcap"
trajectory = "old"
role = "fit"
"""

RIG = """
gravity = { magnitude = { value = 9.80665, unit = "m/s^2", sigma = 0.0, source = "test" } }

[transducer]
on = "wheel"
channels = ["Fx", "Fy", "Fz"]
tilt = { value = [0.0, 0.0], unit = "rad", sigma = 0.0, source = "test" }
cross_coupling = { value = 0.0, unit = "SI by channel pair", sigma = 0.0, source = "test" }
bias = { value = [0, 0, 0], unit = "N", sigma = 1.0, source = "test" }
noise = { value = [0.1, 0.1, 0.1], unit = "N", sigma = 0.0, source = "test" }
resolution = { value = [0, 0, 0], unit = "N", sigma = 0.0, source = "test" }

[joint.wheel]
parent = "lab"
axis = [0, 1, 0]
origin = { value = [0.0, 0.0, 0.0], unit = "m", sigma = 0.0, source = "test" }
misalignment = { value = [0.0, 0.0, 0.0], unit = "rad", sigma = 0.0, source = "test" }
"""

MAPPING = """
schema = 1
campaign = "description/campaign.toml"

[time]
column = "t"
unit = "s"

[wrench]
Fx = { column = "Fx", unit = "N" }
Fy = { column = "Fy", unit = "N" }
Fz = { column = "Fz", unit = "N" }

[encoder]
wheel = { column = "angle", unit = "rad" }

[[recording]]
source = "SOURCE"
trajectory = "turn"
role = "fit"
repeat = 1
"""

UNITS = {"t": "s", "Fx": "N", "Fy": "N", "Fz": "N", "angle": "rad"}
OWN_TIME = MAPPING.replace('[time]\ncolumn = "t"\nunit = "s"\n', "")

WRENCH = Stream("wrench", "/transducer/wrench", ("wrench.force.x", "wrench.force.y", "wrench.force.z"))
ANGLE = Stream("encoder", "/encoder", ("position[wheel]",))


def write_mapping(folder: Path, source: str, text: str = MAPPING) -> Path:
    """Write a mapping with its campaign template; "SOURCE" in the text becomes the source's name."""
    (folder / "description" / "parameters").mkdir(parents=True, exist_ok=True)
    (folder / "description" / "campaign.toml").write_text(CAMPAIGN)
    (folder / "description" / "parameters" / "rig.toml").write_text(RIG)
    path = folder / "mapping.toml"
    path.write_text(text.replace("SOURCE", source))
    return path


def signals(rows: int, seed: int = 1) -> dict[str, np.ndarray]:
    """Return columns whose doubles are hard to parse: all bits in use, tiny, huge, and negative zero."""
    rng = np.random.default_rng(seed)
    values = rng.standard_normal((rows, 4)) * 10.0 ** rng.uniform(-300.0, 300.0, (rows, 4))
    values[0] = (-0.0, 5e-324, 1.7976931348623157e308, 0.1)
    columns = dict(zip(("Fx", "Fy", "Fz", "angle"), values.T, strict=True))
    return {"t": np.round(np.cumsum(rng.uniform(0.0005, 0.0015, rows)), 6), **columns}


def read_back(campaign: Path, name: str) -> dict[str, tuple[Stamps, Array]]:
    """Return stamps and values of a recording of the imported campaign, which must pass every check."""
    return read_streams(load_campaign(campaign).recording(name).path, [WRENCH, ANGLE])


def read_streams(path: Path, streams: Sequence[Stream]) -> dict[str, tuple[Stamps, Array]]:
    """Return stamps and values of streams, whole, by their key."""
    parts: dict[str, list[tuple[Stamps, Array]]] = {}
    for key, block in open_recording(path).read(streams):
        parts.setdefault(key, []).append((block.stamp, block.values))
    return {
        key: (np.concatenate(stamps), np.concatenate(values))
        for key, (stamps, values) in ((key, zip(*pairs, strict=True)) for key, pairs in parts.items())
    }


def write_csv(path: Path, columns: dict[str, np.ndarray]) -> None:
    pd.DataFrame(columns).to_csv(path, index=False)


def write_european(path: Path, columns: dict[str, np.ndarray]) -> None:
    pd.DataFrame(columns).to_csv(path, index=False, sep=";", decimal=",")


def write_tsv(path: Path, columns: dict[str, np.ndarray]) -> None:
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    lines = ["Recorder 7", "\t".join(columns), "s\tN\tN\tN\trad"]
    path.write_text("\n".join([*lines, *("\t".join(map(repr, row)) for row in rows)]))


def write_parquet(path: Path, columns: dict[str, np.ndarray]) -> None:
    pd.DataFrame(columns).to_parquet(path, row_group_size=1000)


def write_hdf5(path: Path, columns: dict[str, np.ndarray]) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        file["t"] = columns["t"]
        file.create_dataset("run/forces", data=np.column_stack([columns[name] for name in ("Fx", "Fy", "Fz")]))
        file["run/forces"].attrs["units"] = "N"
        file["run/angle"] = columns["angle"][None, :]  # as MATLAB writes a row


def write_tdms(path: Path, columns: dict[str, np.ndarray]) -> None:
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(path) as writer:
        for part in np.array_split(np.arange(len(columns["t"])), 3):
            writer.write_segment(
                [ChannelObject("run", name, np.ascontiguousarray(x[part])) for name, x in columns.items()]
            )


def write_mdf(path: Path, columns: dict[str, np.ndarray]) -> None:
    from asammdf import MDF, Signal

    with MDF(version="4.10") as file:
        file.append(
            [Signal(x, columns["t"], name=name, unit=UNITS[name]) for name, x in columns.items() if name != "t"]
        )
        file.start_time = pd.Timestamp("1970-01-01T00:00:00Z").to_pydatetime()
        file.save(path, overwrite=True)


def write_matlab(path: Path, columns: dict[str, np.ndarray]) -> None:
    from scipy.io import savemat

    savemat(path, {"gain": 2.5, **{name: x[:, None] for name, x in columns.items()}}, do_compression=True)


def write_numpy(path: Path, columns: dict[str, np.ndarray]) -> None:
    np.save(path, np.array([columns[name] for name in ("t", "Fx", "Fy", "Fz", "angle")]))


Writer = Callable[[Path, dict[str, np.ndarray]], None]
