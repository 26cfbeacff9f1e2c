"""What EL089_1996 says beside the paper: `python -m end_to_end.nineteen_ninety_six`, from tests/."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from end_to_end.archive_run import Processed, processed
from end_to_end.truth import TrueRun, Truth
from engine.campaigns import CAMPAIGNS
from engine.hardware import Array
from engine.rigid import AZ, EL
from engine.simulation import at, integrate
from kbs_process.signals.records import Signal
from kbs_process.stages import bandpass
from kbs_process.stages.bandpass import Band

NAME = "EL089_1996"
IMPROVED = ("EL089_ADC", "DUMMY_1996", "APM_1996")  # as the paper asked for afterwards
BAND = Band("lt1Hz", 0.02, 1.0)
TORQUES = ("Tx", "Ty", "Tz")


def main() -> None:
    """Process the campaign and print."""
    with tempfile.TemporaryDirectory() as root:
        campaign = processed(NAME, Path(root))
        print("Left by the gravity fit below 0.3 Hz, rms / N m")
        for part, left in ladder(campaign).items():
            print(f"  {part:16}", *(f"{channel} {left[channel]:.4f}" for channel in TORQUES))
        print("Below 1 Hz, rms / N m: measured, noise of the transducer, all that is not known")
        for recording, channel, rms, noise, total in noises(campaign):
            print(f"  {recording:12} {channel} {rms:.5f} {noise:.5f} {total:.5f}, noise {noise / rms:.0%}")
        print("Torque read over torque on a rigid base, and what the matrix of the transducer leaves")
        for gain in resonance(campaign):
            print(f"  {gain}")
        for channel, share in coupling(campaign):
            print(f"  {channel} of EL089P00_1 below 1 Hz: {share:.4f} of all that is not known")
        print("EL089P00_1, Tx below 1 Hz, rms / N m")
        for what, rms in encoders(campaign).items():
            print(f"  {what}: {rms:.5f}")
        for name in (NAME, *IMPROVED):
            print(name)
            for line in improvable(processed(name, Path(root))):
                print(f"  {line}")


def ladder(campaign: Processed) -> dict[str, Mapping[str, float]]:
    """Rms below 0.3 Hz, N m, that each gravity model leaves of what was fitted."""
    return {rung["name"]: rung["rms"] for rung in campaign.results["gravity"]["ladder"]}


def noises(campaign: Processed) -> Iterator[tuple[str, str, float, float, float]]:
    """Recording, torque at T; rms of what was measured, of the sensor's noise, of all uncertainty, N m."""
    measured = {
        (m["recording"], m["band"], m["frame"], m["channel"]): m["measured_rms"] for m in campaign.results["merit"]
    }
    for row in campaign.results["budget"]:
        if (row["band"], row["frame"]) == ("lt1Hz", "T") and row["channel"] in TORQUES:
            noise = next(item["sigma"] for item in row["contributions"] if item["stage"] == "transducer")
            yield (
                row["recording"],
                row["channel"],
                measured[row["recording"], "lt1Hz", "T", row["channel"]],
                noise,
                row["total"],
            )


def improvable(campaign: Processed) -> Iterator[str]:
    """What the paper's improvements change: the static torque, what gravity leaves, noise in the data, a CoG."""
    gravity = campaign.results["gravity"]
    sigmas = {one["name"]: one["sigma"] for one in gravity["parameters"]}
    yield "CoG of the azimuth body, one sigma: " + ", ".join(
        f"{sigmas[f'body.azimuth.cog[{k}]']:.5f} m" for k in (0, 1)
    )
    for one in gravity["channels"]:
        if one["channel"] in TORQUES:
            first = gravity["ladder"][0]["rms"][one["channel"]]
            yield f"{one['channel']}: static {one['static_peak']:.2f} N m, masses and CoGs leave {first:.4f} N m rms"
    yield from resonance(campaign)
    for recording, channel, rms, noise, _ in noises(campaign):
        yield f"{recording} {channel} below 1 Hz: {rms:.5f} N m rms, of which the transducer's noise {noise:.5f}"


def resonance(campaign: Processed) -> Iterator[str]:
    """Gains of the torques at the bands' edges and the first pose."""
    gains = (campaign.results["transducer"] or {}).get("gains", [])
    for one in gains:
        if one["angle_rad"] == gains[0]["angle_rad"]:
            yield f"{one['channel']} at {one['frequency_Hz']:g} Hz: {one['gain']:.2f}"


def coupling(campaign: Processed) -> Iterator[tuple[str, float]]:
    """Share of the whole uncertainty at the spacecraft that cross-coupling has, in EL089P00_1 below 1 Hz."""
    for row in campaign.results["budget"]:
        if (row["recording"], row["band"], row["frame"]) == ("EL089P00_1", "lt1Hz", "S"):
            part = next(item["sigma"] for item in row["contributions"] if item["stage"] == "cross-coupling")
            yield row["channel"], part / row["total"]


def encoders(campaign: Processed) -> dict[str, float]:
    """How far gravity's Tx of EL089P00_1 errs in the band, N m rms, by angles that are not the true ones.

    The angles as read are what 1996 used. The product joins them with the command; its own statement stands beside.
    """
    run = list(Truth(NAME).runs())[1]
    t, read = readings(run)
    dense = integrate(run.hardware, run.commands)
    true = at(dense.t, dense.q[:, [AZ, EL]], t)
    error = read - true - offsets(run)
    slopes = np.array([_slope(run, angles) for angles in true[:: len(true) // 40]])
    slope = at(t[:: len(true) // 40], slopes, t)
    wrong = np.sum(error * slope, axis=1)
    cut = bandpass.apply(Signal(t[0], t[1] - t[0], wrong[:, None], ("Tx",), ("N m",), "T", np.ones(len(t), bool)), BAND)
    (budget,) = (
        row for row in campaign.results["budget"]
        if (row["recording"], row["band"], row["frame"], row["channel"]) == (run.recording, "lt1Hz", "T", "Tx")
    )  # fmt: skip
    (merit,) = (
        row for row in campaign.results["merit"]
        if (row["recording"], row["band"], row["frame"], row["channel"]) == (run.recording, "lt1Hz", "T", "Tx")
    )  # fmt: skip
    return {
        "by the readings alone, true": float(np.sqrt(np.mean(cut.values[cut.valid] ** 2))),
        "by command and readings, stated": next(
            item["sigma"] for item in budget["contributions"] if item["source"].startswith("angles")
        ),
        "measured": merit["measured_rms"],
        "predicted by upper bounds": merit["predicted_rms"],
    }


def readings(run: TrueRun) -> tuple[Array, Array]:
    """Instants by the command's clock (s) and readings (n, 2) of the encoders, on a uniform grid of 10 Hz."""
    path = CAMPAIGNS[NAME].folder / "recordings" / run.run.file
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        rows = [
            (message.log_time, *decoded.position)
            for _, _, message, decoded in reader.iter_decoded_messages(topics=["/encoder"])
        ]
    columns = np.array([row[1:] for row in rows])
    first = next(iter(_log_times(path, "/command")))
    t = (np.array([row[0] for row in rows]) - first) * 1e-9
    grid = t[0] + 0.1 * np.arange(len(t))
    return grid, columns


def _log_times(path: Path, topic: str) -> list[int]:
    with path.open("rb") as file:
        return [message.log_time for _, _, message in make_reader(file).iter_messages(topics=[topic])]


def offsets(run: TrueRun) -> Array:
    """Offsets of the encoders, az and el, rad: no error in a band above 0."""
    return np.array([run.hardware.scalar(f"joint.{axis}.encoder.offset") for axis in ("az", "el")])


def _slope(run: TrueRun, angles: Array) -> Array:
    """Derivatives of gravity's Tx by azimuth and elevation, N m/rad."""
    step = 1e-3
    found = []
    for axis in range(2):
        change = step * np.eye(2)[axis]
        (after, more), (before, less) = run.static(angles + change), run.static(angles - change)
        found.append((more[3] - less[3]) / (after[axis] - before[axis]))
    return np.array(found)


if __name__ == "__main__":
    main()
