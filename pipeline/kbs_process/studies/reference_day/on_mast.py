"""The unit on a mast that yields: what the spacecraft feels at the mast's foot, and how far its head turns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kbs_process.plant.linear.modal import ModalModel, ModalTable, respond
from kbs_process.signals.records import Array, Signal


@dataclass(frozen=True, slots=True, eq=False)
class OnMast:
    """The answer of a mast, at the working rate."""

    wrench: Signal  # at its foot, about T's origin, in T
    turn: Signal  # of its head, rad, a rotation vector in T


def answer(rigid: Signal, angle: Signal, mast: ModalTable) -> OnMast:
    """Return the answer to the wrench of a unit on a rigid interface; `angle` has the joints', on the same axis.

    Modes above the passband of the working rate have nothing to answer: they are left out, which errs by (f / f_k)^2.
    """
    at = angle.column(mast.joint)
    wrench = respond(rigid.values, rigid.dt, at, mast)
    moved = respond(rigid.values, rigid.dt, at, mast, ModalModel.compliance)
    frame = "T"
    return OnMast(
        wrench=rigid.derive(wrench, "through the modes of the mast"),
        turn=Signal(
            rigid.t0, rigid.dt, moved[:, 3:], ("x", "y", "z"), ("rad",) * 3, frame, rigid.valid, ("turn of the mast",)
        ),
    )


def off_boresight(turn: Array, q: Array) -> Array:
    """Cross-elevation and elevation (n, 2), rad, by which turns (n, 3) in T take the boresight at joint angles q.

    $u = (\\cos e \\cos a, \\cos e \\sin a, \\sin e)$ moves by $\\theta \\times u$, first order.
    """
    (ca, sa), (ce, se) = ((np.cos(x), np.sin(x)) for x in q[:, :2].T)
    u = np.stack([ce * ca, ce * sa, se], axis=1)
    across, along = np.stack([-sa, ca, 0.0 * ca], axis=1), np.stack([-ca * se, -sa * se, ce], axis=1)
    moved = np.cross(turn, u)
    return np.stack([np.sum(moved * across, axis=1), np.sum(moved * along, axis=1)], axis=1)
