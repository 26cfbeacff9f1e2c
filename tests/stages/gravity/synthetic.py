"""Recordings made from a rig with other numbers than the fit begins with: noise, taring bias, quantised encoders."""

from __future__ import annotations

import numpy as np

from kbs_process.plant.rigid import inverse_dynamics
from kbs_process.rig.model import substitute
from kbs_process.signals.records import WRENCH_CHANNELS, WRENCH_UNITS, Events, Run, Signal
from kbs_process.signals.smoothing import smooth

RATE, FINE = 20.0, 200.0


def perturbed(rig, rng, *, names=(".mass", ".cog", ".tilt", ".misalignment", ".offset"), scale=1.0):
    """The rig as it might truly be: chosen quantities drawn from their priors."""
    values = {
        name: q.value + scale * q.sigma * rng.standard_normal(q.shape)
        for name, q in rig.quantities().items()
        if name.endswith(names)
    }
    return substitute(rig, values)


def staircase(seconds, stops):
    """Pseudo-static angle: slow smooth moves between stops, at FINE Hz."""
    t = np.arange(int(seconds * FINE)) / FINE
    knots = np.linspace(0, seconds, 2 * len(stops))
    levels = np.repeat(stops, 2)
    return smooth(np.interp(t, knots, levels), 1 / FINE, 0.3)


def record(rig, name, q_fine, rng, *, noise=None, bias=None, deviation=0.0):
    """A run at RATE from true angles (n, joints) at FINE Hz; the command is the true angle less `deviation`."""
    factor = int(FINE / RATE)
    dt = 1 / RATE
    t_fine = np.arange(len(q_fine)) / FINE
    readings = np.empty_like(q_fine)
    for index, joint in enumerate(rig.joints):
        step, offset = (0.0, 0.0) if joint.encoder is None else (joint.encoder.step, joint.encoder.offset)
        angle = q_fine[:, index] + float(offset)
        readings[:, index] = angle if float(step) == 0 else np.round(angle / float(step)) * float(step)
    angle = smooth(readings, 1 / FINE, 5.0)[::factor]
    q = q_fine[::factor]
    qd, qdd = (smooth(q_fine, 1 / FINE, 2.0, derivative=d)[::factor] for d in (1, 2))
    wrench = inverse_dynamics(rig, q, qd, qdd)
    bias = rig.transducer.bias.sigma * rng.standard_normal(6) if bias is None else bias
    noise = np.repeat([0.02, 0.002], 3) if noise is None else noise
    wrench = wrench + bias + noise * rng.standard_normal(wrench.shape)
    valid = np.ones(len(q), dtype=bool)
    names = rig.joint_names
    index = [WRENCH_CHANNELS.index(c) for c in rig.transducer.channels]
    return Run(
        name=name,
        wrench=Signal(
            0.0, dt, wrench[:, index], rig.transducer.channels, tuple(WRENCH_UNITS[i] for i in index), "T", valid
        ),
        angle=Signal(0.0, dt, angle, names, ("rad",) * len(names), "joint", valid),
        rate=None,
        command=Events(t_fine[:: factor * 2], (q_fine - deviation)[:: factor * 2], names),
        field=None,
        temperature=None,
        encoder=None,
        spectrum=None,
        envelope=None,
        epoch_ns=0,
        rates={"angle": FINE},
    )
