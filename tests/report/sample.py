"""Synthetic results folders, as the pipeline writes them: six channels, and one channel driven by motion."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from kbs_process.results.judged import Budget, BudgetItem, ChannelResult, Frame, Requirement
from kbs_process.results.records import Check, Conclusion, Constant, InputFile, Notice, Provenance, encode
from kbs_process.signals.records import Loss
from kbs_process.stages.conventions import SignCheck
from kbs_process.studies.correlate import results as r

CHANNELS = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")
UNITS = dict(zip(CHANNELS, ("N", "N", "N", "N m", "N m", "N m"), strict=True))
SCALE = dict(zip(CHANNELS, (0.08, 0.06, 0.05, 0.021, 0.034, 0.006), strict=True))
STATIC = dict(zip(CHANNELS, (0.6, -0.4, -275.0, 9.0, -7.5, 0.2), strict=True))
BANDS = (
    r.Band(name="unfiltered", label="unfiltered", high_pass_Hz=None, low_pass_Hz=None, method="none"),
    r.Band(
        name="lt1Hz",
        label="below 1 Hz",
        high_pass_Hz=0.01,
        low_pass_Hz=1.0,
        method="zero-phase Butterworth of order 4, low-frequency basis by regression",
        edge_s=6.5,
        edge_error=1e-3,
    ),
    r.Band(
        name="lt2Hz",
        label="below 2 Hz",
        high_pass_Hz=0.01,
        low_pass_Hz=2.0,
        method="zero-phase Butterworth of order 4, low-frequency basis by regression",
        edge_s=4.0,
        edge_error=1e-3,
    ),
)
RUNS = (
    ("AZPS_ATA", "AZPS_ATA", "calibration", 1, 900.0),
    ("EL089P00_1", "EL089P00", "fit", 1, 200.0),
    ("EL089P00_2", "EL089P00", "held-out", 2, 200.0),
)
PROVENANCE = Provenance(
    version="0.1.0",
    python="3.12.3",
    libraries={"numpy": "2.2.1", "scipy": "1.15.0"},
    platform="Linux x86_64",
    command="kbs-process campaign/EL089",
    commit="0123456789abcdef0123456789abcdef01234567",
    inputs=(InputFile(file="campaign.toml", sha256="a" * 64), InputFile(file="parameters/rig.toml", sha256="b" * 64)),
)


def six_channels(folder: Path) -> Path:
    """Write a command-driven campaign of three recordings on a complete transducer."""
    rng = np.random.default_rng(89)
    for name, _, role, _, duration in RUNS:
        _gravity(folder, name, duration, CHANNELS, rng)
        _spectrum(folder, name, CHANNELS, rng, predicted=role != "calibration")
        if role != "calibration":
            for band in BANDS:
                for frame in ("T", "S"):
                    _band(folder, name, band, frame, duration, CHANNELS, rng)
    _write(folder, command_results())
    return folder


def one_channel(folder: Path) -> Path:
    """Write a motion-driven campaign: one moment, no spacecraft, no requirement, nothing repeated."""
    rng = np.random.default_rng(7)
    names = tuple(f"trial_{index:02d}" for index in range(1, 4))
    for name in names:
        _gravity(folder, name, 30.0, ("Tz",), rng)
        _spectrum(folder, name, ("Tz",), rng, predicted=True)
        _band(folder, name, BANDS[0], "T", 30.0, ("Tz",), rng)
    recordings = tuple(_recording(name, "trial", "held-out", 1, 30.0, ()) for name in names)
    merit = tuple(_merit(name, "held-out", "unfiltered", "T", "Tz", index) for index, name in enumerate(names))
    _write(
        folder,
        r.Results(
            campaign=r.CampaignSummary(
                name="smartwheel",
                title="Instrumented wheel, coasting",
                article="Instrumented wheel",
                configuration="",
                drive="motion",
            ),
            verdict=Conclusion(status="none", sentence="No requirement is stated; three trials were compared."),
            provenance=PROVENANCE,
            recordings=recordings,
            bands=BANDS[:1],
            merit=merit,
            methods="The inverse dynamics of the measured motion gave the predicted wrench.",
        ),
    )
    return folder


def command_results() -> r.Results:
    """Return the contents of a complete results.json."""
    loss = Loss(kind="gap", where="EL089P00_1.mcap /transducer/wrench", count=412, start_s=63.2, end_s=63.612)
    recordings = tuple(
        _recording(name, trajectory, role, repeat, duration, (loss,) if name == "EL089P00_1" else ())
        for name, trajectory, role, repeat, duration in RUNS
    )
    compared = [run for run in RUNS if run[2] != "calibration"]
    return r.Results(
        campaign=r.CampaignSummary(
            name="EL089",
            title="Elevation pre-pointing, 70 to 87 deg",
            article="Ka-band outboard assembly, engineering model, antenna",
            configuration="2: real antenna, high elevation, no gravity compensation",
            drive="command",
        ),
        verdict=Conclusion(
            status="pass",
            sentence="The disturbance torque at the spacecraft's centre of mass stays below 0.06 N m between 0.01 "
            "and 1 Hz: 0.0412 N m (0.0273 to 0.0474 at 95 %; Ty, EL089P00_2), a margin of 31 %.",
        ),
        document=r.DocumentHead(number="TR-089", revision="B", operator="A. Tester", date="1995-06-15"),
        model=r.ModelVerdict(status="correlated", sentence="The prediction explains 87 % of the variance of Ty."),
        provenance=PROVENANCE,
        requirements=(_requirement(),),
        warnings=(
            Notice(
                severity="warning",
                what="412 samples of /transducer/wrench are missing between 63.2 s and 63.6 s",
                where="EL089P00_1.mcap",
                remedy="the stretch is left out of every figure; repeat the run if it matters",
            ),
            Notice(
                severity="warning",
                what="the first resonance (2.7 Hz, about y) lies next to the 2 Hz low-pass",
                where="band lt2Hz",
                remedy="judge by the 1 Hz band",
            ),
            Notice(severity="info", what="temperature was not recorded", where="all recordings"),
        ),
        recordings=recordings,
        conventions=(
            SignCheck(check="sign of gravity", expected="Fz < 0 at rest", found="Fz = −274.6 N", ok=True),
            SignCheck(check="Ty follows elevation", expected="slope > 0", found="slope +4.1 N m/rad", ok=True),
            SignCheck(check="taring", expected="raw mean of Fz near the weight", found="0.4 N apart", ok=True),
        ),
        gravity=_gravity_result(),
        cross_coupling=_coupling(),
        bands=BANDS,
        repeatability=tuple(
            r.Repeatability(
                trajectory="EL089P00",
                band=band.name,
                frame=frame,
                channel=channel,
                unit=UNITS[channel],
                signal_rms=0.4 * SCALE[channel],
                noise_rms=(0.05 + 0.09 * index) * SCALE[channel],
                ratio=0.4 / (0.05 + 0.09 * index),
                n=2,
            )
            for band in BANDS
            for frame in ("T", "S")
            for index, channel in enumerate(CHANNELS)
        ),
        merit=tuple(
            _merit(name, role, band.name, frame, channel, index)
            for band in BANDS
            for frame in ("T", "S")
            for name, _, role, _, _ in compared
            for index, channel in enumerate(CHANNELS)
        ),
        resonances=(
            r.Resonance(axis="about y", frequency_Hz=2.71, source="plant at 78 deg", sigma_Hz=0.08),
            r.Resonance(axis="about x", frequency_Hz=2.94, source="plant at 78 deg", sigma_Hz=0.09),
            r.Resonance(axis="about z", frequency_Hz=10.4, source="plant at 78 deg"),
        ),
        six_channels=tuple(
            r.SixChannels(
                recording=name,
                band="lt1Hz",
                chi_square=chi_square,
                explained=chi_square < 2.0,
                peak={"Tx": 0.0021, "Ty": 0.0032, "Tz": 0.0016},
                sigma={"Tx": 0.0004, "Ty": 0.0011, "Tz": 0.0005},
            )
            for name, chi_square in (("EL089P00_1", 0.97), ("EL089P00_2", 11.3))
        ),
        budget=tuple(
            Budget(
                channel=channel,
                unit=UNITS[channel],
                frame=frame,
                band=band,
                recording=recording,
                contributions=_contributions(SCALE[channel] * (0.08 if band == "lt1Hz" else 0.11), index),
                total=float(
                    np.sqrt(
                        sum(
                            item.sigma**2
                            for item in _contributions(SCALE[channel] * (0.08 if band == "lt1Hz" else 0.11), index)
                        )
                    )
                ),
            )
            for band in ("lt1Hz", "lt2Hz")
            for frame in ("S", "T")
            for recording in ("EL089P00_1", "EL089P00_2")
            for index, channel in enumerate(CHANNELS)
        ),
        methods="Recordings were condensed to 20 Hz by a linear-phase Kaiser FIR (gain error at most 1e-5).\n\n"
        "Gravity was fitted over three recordings and subtracted; the residual was band-passed.",
        parameters=(
            Constant(name="body.antenna.mass", value=14.0, unit="kg", sigma=0.05, source="weighed, dummy data sheet"),
            Constant(
                name="transducer.cross_coupling",
                value="6 x 6, see Cross-coupling",
                unit="1",
                sigma=None,
                source="calibration",
            ),
            Constant(name="joint.el.drive.Ka", value=1.0e4, unit="N m/rad", sigma=500.0, source="EM fit"),
        ),
        notes=(
            "Torque fluctuations are taken to arise in the motor gears and to reach the spacecraft as through "
            "the rigid interface.",
        ),
    )


def _requirement() -> Requirement:
    values = {"Tx": (0.0287, 0.0026), "Ty": (0.0412, 0.0031), "Tz": (0.0079, 0.0009)}
    return Requirement(
        name="Disturbance torque at the spacecraft's centre of mass",
        quantity="torque",
        frame="S",
        statistic="peak",
        band="lt1Hz",
        band_Hz=(0.01, 1.0),
        limit=0.06,
        unit="N m",
        value=0.0412,
        sigma=0.0031,
        low=0.0273,
        high=0.0474,
        margin=0.0188,
        verdict="pass",
        recording="EL089P00_2",
        channel="Ty",
        time_s=71.35,
        predicted_value=0.0467,
        channels=tuple(
            ChannelResult(
                channel=channel,
                value=value,
                sigma=sigma,
                low=value - 4.5 * sigma,
                high=value + 2.0 * sigma,
                predicted=1.13 * value,
                recording="EL089P00_2",
                time_s=71.35,
            )
            for channel, (value, sigma) in values.items()
        ),
        source="main system requirements, section 2",
    )


def _recording(
    name: str, trajectory: str, role: r.Role, repeat: int, duration: float, losses: tuple[Loss, ...]
) -> r.Recording:
    return r.Recording(
        name=name,
        file=f"recordings/{name}.mcap",
        trajectory=trajectory,
        role=role,
        repeat=repeat,
        sha256=f"{len(name):064x}",
        duration_s=duration,
        rates={"wrench": 1000.02, "angle": 100.0, "command": 10.0},
        losses=losses,
        clocks=(r.Clock(stream="angle", offset_s=0.00213, skew=3.4e-6, sigma_s=0.00004),),
    )


def _merit(name: str, role: r.Role, band: str, frame: Frame, channel: str, index: int) -> r.Merit:
    peak = SCALE[channel] * (1.0 if band == "lt1Hz" else 1.7) * (0.95 if role == "fit" else 1.0)
    ratio = 1.15 - 0.06 * index
    return r.Merit(
        recording=name,
        role=role,
        band=band,
        frame=frame,
        channel=channel,
        unit=UNITS[channel],
        measured_rms=0.31 * peak,
        predicted_rms=0.33 * peak,
        residual_rms=0.09 * peak,
        measured_peak=peak,
        predicted_peak=ratio * peak,
        correlation=0.96 - 0.05 * index,
        fraction_of_variance=0.93 - 0.2 * index,
        spectral_ratio=1.08,
        pessimism=ratio,
        sigma=0.02 * peak,
    )


def _contributions(scale: float, index: int) -> tuple[BudgetItem, ...]:
    return (
        BudgetItem(stage="gravity", source="encoder quantisation and noise", sigma=scale),
        BudgetItem(stage="gravity", source="covariance of the fit", sigma=0.4 * scale),
        BudgetItem(stage="decouple", source="calibration of X", sigma=(0.2 + 0.1 * index) * scale),
        BudgetItem(stage="bandpass", source="edges", sigma=0.15 * scale),
        BudgetItem(stage="transducer", source="noise in band", sigma=0.6 * scale),
    )


def _gravity_result() -> r.Gravity:
    cog = ("x", "y", "z")
    return r.Gravity(
        parameters=(
            r.FittedParameter(
                name="body.antenna.mass", unit="kg", prior=14.0, prior_sigma=0.05, value=14.021, sigma=0.0041
            ),
            *(
                r.FittedParameter(
                    name=f"body.antenna.cog[{axis}]",
                    unit="m",
                    prior=value,
                    prior_sigma=0.005,
                    value=value + shift,
                    sigma=0.00012,
                )
                for axis, value, shift in zip(cog, (0.07, 0.06, -0.02), (0.0021, -0.0008, 0.0131), strict=True)
            ),
            r.FittedParameter(
                name="transducer.tilt[x]", unit="rad", prior=0.0, prior_sigma=0.003, value=0.00087, sigma=0.00002
            ),
            r.FittedParameter(
                name="transducer.bias[Fz]", unit="N", prior=None, prior_sigma=None, value=0.412, sigma=0.013
            ),
        ),
        channels=tuple(
            r.GravityChannel(
                channel=channel,
                unit=UNITS[channel],
                static_peak=abs(STATIC[channel]),
                residual_rms=0.5 * SCALE[channel],
                encoder_sigma=0.08 * SCALE[channel],
                model_sigma=0.03 * SCALE[channel],
            )
            for channel in CHANNELS
        ),
        checks=(
            Check(name="condition", ok=True, detail="condition number 41 of 1e6"),
            Check(name="residual", ok=True, detail="reduced chi-square 1.04"),
            Check(name="priors", ok=False, detail="body.antenna.cog[z] moved 2.6 prior sigma; weigh the antenna again"),
        ),
        samples=26000,
        reduced_chi_square=1.04,
        feasible="Computed gravity compensation is feasible: its error is 0.003 N m, 5 % of the limit.",
        ladder=tuple(
            r.Rung(
                name=name,
                rms={channel: share * SCALE[channel] for channel in CHANNELS},
                peak={channel: 3.0 * share * SCALE[channel] for channel in CHANNELS},
            )
            for name, share in (("masses and CoGs", 0.4), ("tilt", 0.05))
        ),
    )


def _coupling() -> r.CrossCoupling:
    rng = np.random.default_rng(6)
    matrix = np.round(2e-3 * rng.standard_normal((6, 6)), 6)
    sigma = np.full((6, 6), 1.5e-4)
    return r.CrossCoupling(
        channels=CHANNELS,
        matrix=tuple(map(tuple, matrix.tolist())),
        sigma=tuple(map(tuple, sigma.tolist())),
        largest="The largest coupling takes 0.9 N m of raw Tx from the weight (Fz).",
        contributions=tuple(
            r.Contribution(channel=channel, unit=UNITS[channel], value=0.2 * abs(STATIC[channel]))
            for channel in CHANNELS
        ),
    )


def _time(duration: float) -> np.ndarray:
    return np.arange(round(20.0 * duration)) / 20.0


def _burst(t: np.ndarray, channel: str) -> np.ndarray:
    envelope = np.exp(-(((t - 0.3 * t[-1]) / 9.0) ** 2)) + 0.8 * np.exp(-(((t - 0.75 * t[-1]) / 7.0) ** 2))
    return SCALE[channel] * (
        envelope * np.sin(2 * np.pi * 0.83 * t + len(channel)) + 0.1 * np.sin(2 * np.pi * 0.05 * t)
    )


def _valid(t: np.ndarray, name: str) -> np.ndarray:
    return ~((t > 63.2) & (t < 64.6)) if name == "EL089P00_1" else np.ones(len(t), dtype=bool)


def _gravity(folder: Path, name: str, duration: float, channels: tuple[str, ...], rng: np.random.Generator) -> None:
    t = _time(duration)
    columns: dict[str, np.ndarray] = {"t": t, "valid": _valid(t, name)}
    for channel in channels:
        static = STATIC[channel] * np.cos(0.3 * np.tanh((t - t[-1] / 2) / (t[-1] / 5)) + 0.2)
        residual = _burst(t, channel) + 0.1 * SCALE[channel] * rng.standard_normal(len(t))
        columns |= {
            f"{channel}.measured": static + residual,
            f"{channel}.static": static,
            f"{channel}.residual": residual,
        }
    _table(folder / "tables" / "gravity" / f"{name}.parquet", name, "T", columns)


def _band(
    folder: Path,
    name: str,
    band: r.Band,
    frame: str,
    duration: float,
    channels: tuple[str, ...],
    rng: np.random.Generator,
) -> None:
    t = _time(duration)
    valid = _valid(t, name) & (t >= band.edge_s) & (t <= t[-1] - band.edge_s)
    columns: dict[str, np.ndarray] = {"t": t, "valid": valid}
    noise = 0.25 if band.name == "unfiltered" else 0.04
    for channel in channels:
        burst = _burst(t, channel)
        columns[f"{channel}.measured"] = burst + noise * SCALE[channel] * rng.standard_normal(len(t))
        columns[f"{channel}.predicted"] = 1.13 * burst
    kind = "spacecraft" if frame == "S" else "bands"
    _table(folder / "tables" / kind / f"{name}.{band.name}.parquet", name, frame, columns)


def _spectrum(folder: Path, name: str, channels: tuple[str, ...], rng: np.random.Generator, *, predicted: bool) -> None:
    f = np.arange(1, 4001) * 0.05
    columns = {"f": f}
    for channel in channels:
        shape = SCALE[channel] ** 2 * (0.02 / (0.05 + f**2) + 0.3 / ((f - 2.7) ** 2 + 0.02) / 50 + 1e-5)
        columns[f"{channel}.measured"] = shape * rng.gamma(20, 1 / 20, len(f))
        if predicted:
            columns[f"{channel}.predicted"] = 1.2 * shape
    _table(folder / "tables" / "spectrum" / f"{name}.parquet", name, "T", columns)


def _table(path: Path, recording: str, frame: str, columns: dict[str, np.ndarray]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    units = {name: UNITS.get(name.partition(".")[0], "") for name in columns}
    if "f" in columns:
        units = {name: f"({unit})^2/Hz" for name, unit in units.items()}
    units |= {"t": "s", "f": "Hz"}
    about = {"recording": recording, "frame": frame, "units": units, "history": ["synthetic"]}
    table = pa.table({name: pa.array(values) for name, values in columns.items()})
    pq.write_table(table.replace_schema_metadata({b"kbs": json.dumps(about).encode()}), path)


def _write(folder: Path, results: r.Results) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "results.json").write_bytes(encode(results))
