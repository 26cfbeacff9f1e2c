"""Table 1 as a fit: the gear's error of each axis and the loop's gains, chosen on half of the sections.

`cd tests && python -m mission.table1` flies the archived day with each of some errors and gains. It takes those whose
95 % are nearest to the paper's in every second section, and scores them on the others; then the other way round.
Nearness is the rms of the logarithm of the ratio, over both axes; exp of it is a factor.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from archived import campaign
from kbs_process.campaign.mission import boundaries
from kbs_process.mission.planner import plan
from kbs_process.plant.laws import select
from kbs_process.plant.linear.linearise import linearise
from kbs_process.plant.predict import predict_together, simulation_of
from kbs_process.rig.model import Joint, Quantity, Rig
from kbs_process.signals.records import Array
from kbs_process.stages.gravity.equation import encoder_offsets
from kbs_process.stages.pointing import SHARE
from kbs_process.studies.reference_day.flying import commands
from kbs_process.studies.stability import loop
from mission import reference

ERROR, RATE, WRENCH_RATE = "kinematic_error", 20.0, 100.0  # Hz
AMPLITUDES = 1e-4 * np.arange(0.8, 2.3, 0.2)  # rad; suppliers state 1.5e-4 to 2.2e-4
GAINS = (1.0, 0.5, 0.25, 0.1)  # times Kp, and its square times Ki: the same damping
POSES = np.radians([[0.0, -20.0], [0.0, 30.0], [0.0, 80.0]])


def rig_with(rig: Rig, amplitude: float, gain: float) -> Rig:
    """The rig with an error in both gears, twice a motor turn, and gains times a factor."""
    known = {"kinematic_sin": amplitude, "kinematic_cos": 0.0, "kinematic_order": 2.0}

    def joint(one: Joint) -> Joint:
        assert one.drive is not None
        own = {name: Quantity(f"joint.{one.name}.drive.{name}", np.array(x), "", np.zeros(()), "tried")
               for name, x in known.items()}  # fmt: skip
        return replace(one, drive=replace(one.drive, parameters=one.drive.parameters | own))

    assert rig.controller is not None
    Kp, Ki = (replace(x, value=x.value * gain**n) for n, x in ((1, rig.controller.Kp), (2, rig.controller.Ki)))
    return replace(rig, joints=tuple(map(joint, rig.joints)), controller=replace(rig.controller, Kp=Kp, Ki=Ki))


def fly() -> tuple[Array, Array, tuple[str, ...]]:
    """95 % of the error, mdeg (gains, amplitudes, sections, 2), the paper's (sections, 2), and the sections' names."""
    given, day = campaign("REFDAY", recordings=False), reference.day()
    planned, effects = plan(day.mission, day.lead), (*given.effects, ERROR)
    spans = boundaries(day, planned)
    every = [rig_with(given.rig, amplitude, gain) for gain in GAINS for amplitude in AMPLITUDES]
    found = []
    for begin in range(0, len(every), 8):
        group = [
            simulation_of(
                rig, effects, commands(planned, rig), rate_Hz=WRENCH_RATE, angle_rate_Hz=RATE,
                duration_s=day.mission.duration,
            )
            for rig in every[begin : begin + 8]
        ]  # fmt: skip
        for _, angle in predict_together(group, WRENCH_RATE, day.mission.duration):
            t = np.arange(len(angle)) / RATE
            desired = np.stack([np.interp(t, planned.t, column) for column in planned.q.T], axis=1)
            error = np.abs(angle - encoder_offsets(given.rig) - desired)
            found.append([np.quantile(error[(t >= a) & (t < b)], SHARE, axis=0) for _, a, b in spans])
        print(f"{len(found)} of {len(every)} days", flush=True)
    paper = [(entry.published.azimuth_mdeg, entry.published.elevation_mdeg) for entry, _, _ in spans if entry.published]
    shape = (len(GAINS), len(AMPLITUDES), len(spans), 2)
    return 1e3 * np.degrees(np.reshape(found, shape)), np.array(paper), tuple(entry.name for entry, _, _ in spans)


def chosen(ours: Array, paper: Array, half: slice) -> tuple[int, list[int]]:
    """Which gains, and which amplitude of each axis, come nearest in the sections of a half."""
    square = np.mean(np.log(ours[:, :, half] / paper[half]) ** 2, axis=2)  # (gains, amplitudes, axes)
    gain = int(np.argmin(square.min(axis=1).sum(axis=1)))
    return gain, [int(np.argmin(square[gain, :, axis])) for axis in range(2)]


def factor(ours: Array, paper: Array) -> float:
    """Exp of the rms of ln(ours / paper)."""
    return float(np.exp(np.sqrt(np.mean(np.log(ours / paper) ** 2))))


def margins(gain: float) -> str:
    """The least critical factor on the gains, and the least margins, over some poses."""
    given = campaign("REFDAY", recordings=False)
    rig = rig_with(given.rig, AMPLITUDES[0], gain)
    assert rig.controller is not None
    factors, decibels, degrees = [], [], []
    for pose in POSES:
        system = linearise(rig, select(given.effects), pose)
        factors.append(loop.critical(system, rig.controller).factor)
        for name in rig.joint_names:
            own = loop.margins(loop.loop(system, rig.controller), name, float(pose[1]))
            decibels.append(20.0 * np.log10(own.gain or np.inf))
            degrees.append(np.degrees(own.phase_rad or np.nan))
    return f"gains may grow {min(factors):.1f} times; {min(decibels):.1f} dB, {np.nanmin(degrees):.0f} deg"


def main() -> None:
    """Print both halves' choices, their scores, and the margins."""
    ours, paper, names = fly()
    print(f"as archived, without the error, see `kbs-process reference-day`; least gains of {GAINS}")
    halves = slice(0, None, 2), slice(1, None, 2)
    for half, other in (halves, halves[::-1]):
        gain, pair = chosen(ours, paper, half)
        day = np.stack([ours[gain, pair[axis], :, axis] for axis in range(2)], axis=1)
        amplitudes = ", ".join(f"{1e4 * AMPLITUDES[i]:.1f}e-4 rad" for i in pair)
        print(f"chosen on {', '.join(names[half])}: gains x {GAINS[gain]:g}, errors {amplitudes} (azimuth, elevation)")
        print(
            f"  factor there {factor(day[half], paper[half]):.2f}, on the others {factor(day[other], paper[other]):.2f}"
        )
        for axis, which in enumerate(("azimuth", "elevation")):
            print(f"  {which} / mdeg: {' '.join(f'{x:.1f}' for x in day[:, axis])}")
        print(f"  margins: {margins(GAINS[gain])}")
    print(f"margins of the archived gains: {margins(1.0)}")


if __name__ == "__main__":
    main()
