"""Loaders of the real recordings into runs, and rigs to process them with; see ../shared/data/README.md."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.signal import butter, sosfiltfilt

from kbs_process.rig.model import Rig
from kbs_process.signals.records import WRENCH_CHANNELS, WRENCH_UNITS, Run, Signal
from plant.rigs import body, joint, quantity, transducer

DATA = Path(__file__).resolve().parents[4] / "shared" / "data"


def _run(name, dt, wrench, channels, angle=None, rate=None, joint_name=""):
    valid = np.ones(len(wrench), dtype=bool)
    units = tuple(WRENCH_UNITS[WRENCH_CHANNELS.index(c)] for c in channels)

    def motion(values, unit):
        return None if values is None else Signal(0.0, dt, values[:, None], (joint_name,), (unit,), "joint", valid)

    return Run(
        name=name,
        wrench=Signal(0.0, dt, wrench, channels, units, "T", valid),
        angle=motion(angle, "rad"),
        rate=motion(rate, "rad/s"),
        command=None,
        field=None,
        temperature=None,
        encoder=None,
        spectrum=None,
        envelope=None,
        epoch_ns=0,
        rates={} if angle is None else {"angle": 1 / dt},
    )


def turn_about_z(wrench, angle):
    """Components of (n, 6) wrenches in axes turned by -angle about z."""
    c, s = np.cos(angle), np.sin(angle)
    turned = wrench.copy()
    for x, y in ((0, 1), (3, 4)):
        turned[:, x] = c * wrench[:, x] - s * wrench[:, y]
        turned[:, y] = s * wrench[:, x] + c * wrench[:, y]
    return turned


def smartwheel(which):
    """The wheel's run with its wrench in axes that turn with it.

    The file gives forces and moments in axes that do not turn, x of the forces with the other sign.
    """
    columns = np.genfromtxt(
        DATA / "smartwheel" / f"pushrimkinetics_offsets_{which}.csv", delimiter=",", usecols=(3, *range(18, 24))
    )
    angle = np.unwrap(np.radians(columns[:, 0]))
    hub = columns[:, 1:] * np.array([-1.0, 1, 1, 1, 1, 1])
    return _run(which, 1 / 240, turn_about_z(hub, -angle), WRENCH_CHANNELS, angle=angle, joint_name="wheel")


def hub_axes(wrench, angle):
    """Back to the file's axes and signs, in which its figures are given."""
    return turn_about_z(wrench, angle) * np.array([-1.0, 1, 1, 1, 1, 1])


def smartwheel_rig():
    X = np.zeros((6, 6))
    X[:3, :3] = X[3:, 3:] = 0.01
    X[3:, :3], X[:3, 3:] = 0.01, 0.05
    return Rig(
        quantity("gravity.magnitude", 9.80665),
        transducer("wheel", tilt=(np.pi / 2, 0), s_x=X, s_bias=(20.0, 2.0)),
        (
            body(
                "pushrim",
                "T",
                0.65,
                [0, 0, 0.035],
                [0.02, 0.02, 0.04, 0, 0, 0],
                0.3,
                [0.003, 0.003, 0.03],
                [0.02] * 3 + [0.0] * 3,
            ),
        ),
        (joint("wheel", "lab", (0, -1, 0), step=2 * np.pi / 4096, s_mis=[0.05, 0, 0.05], s_offset=0.1),),
        None,
        None,
    )


def treadmill(which):
    """One trial on a uniform axis of 100 Hz by its time stamps, repeated stamps dropped."""
    t, moment, speed = np.loadtxt(DATA / "treadmill_pitch" / f"Random{which}.txt", skiprows=1).T
    keep = np.diff(t, prepend=-np.inf) > 1e-4
    uniform = np.arange(t[0], t[-1], 0.01)
    moment, speed = (np.interp(uniform, t[keep], x[keep]) for x in (moment, speed))
    return _run(which, 0.01, moment[:, None], ("Ty",), rate=speed / DRUM_RADIUS, joint_name="belt")


DRUM_RADIUS = 0.1  # m, nominal: sets only the scale of the fitted inertia


def treadmill_rig():
    """Belt and drums as one body that turns about the pitch axis, its weight borne without a moment.

    No recording says which way it turns: the other way, its inertia would be negative.
    """
    return Rig(
        quantity("gravity.magnitude", 9.80665),
        transducer(channels=("Ty",), s_bias=(0.0, 20.0)),
        (body("drums", "belt", 50.0, [0, 0, 0], [0, 0, 0, 0, 0, 0], 0.0, 0.0, [0, 2.0, 0, 0, 0, 0]),),
        (joint("belt", "T", (0, -1, 0)),),
        None,
        None,
    )


def low_pass(values, dt, corner):
    """The scoring filter: second-order Butterworth forwards and backwards about the line between the ends."""
    line = np.linspace(values[0], values[-1], len(values))
    sos = butter(2, corner, fs=1 / dt, output="sos")
    return line + sosfiltfilt(sos, values - line, axis=0, padlen=int(3 / (corner * dt)))


def hand_free(run):
    """Where no hand touches the rim, by the moment about the axle and the turning rate alone.

    Neither gravity nor a bias can make the axle's moment vary by more than its spread without a hand: the wheel turns,
    and that moment, low-passed at 6 Hz, stays for 0.4 s within 0.25 N m of its lower quartile (coasting); 0.1 s is
    taken off either end. No force that is scored takes part in the choice.
    """
    dt = run.wrench.dt
    moment = low_pass(run.wrench.column("Tz"), dt, 6.0)
    rate = np.gradient(low_pass(run.angle.values[:, 0], dt, 6.0), dt)
    quiet = (np.abs(moment - np.quantile(moment, 0.25)) < 0.25) & (rate > 1.0)
    free = np.zeros(len(quiet), dtype=bool)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], quiet.view(np.int8), [0]])))
    for start, stop in edges.reshape(-1, 2):
        if (stop - start) * dt >= 0.4:
            free[start + int(0.1 / dt) : stop - int(0.1 / dt)] = True
    return free
