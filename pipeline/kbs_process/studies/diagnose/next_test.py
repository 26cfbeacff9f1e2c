"""The test that a diagnosis proposes: simulated on all cores, its commands as a table, what it will show."""

from __future__ import annotations

import math

import numpy as np

from kbs_process.diagnosis.experiments.floor import Floor
from kbs_process.diagnosis.selection.next_test import Proposal, propose
from kbs_process.diagnosis.selection.outcome import Identity, Outcome
from kbs_process.rig.model import Rig
from kbs_process.studies.diagnose import results as records
from kbs_process.studies.diagnose.simulators import Simulators


def proposed(outcome: Outcome, floor: Floor) -> Proposal | None:
    """Return the next test for what a diagnosis leaves open, if anything is, and if commands drive the rig."""
    return propose(outcome.standing, outcome.finds, floor, Simulators)


def commands_of(proposal: Proposal, rig: Rig) -> str:
    """CSV as `simulate --command` reads it: t (s), angles (rad) and rates (rad/s) of all joints."""
    schedule, names = proposal.trajectory.schedule, rig.joint_names
    head = ["t", *names, *(f"{name}.rate" for name in names)]
    rows = np.column_stack([schedule.t, schedule.position, schedule.rate])
    lines = [",".join([f"{row[0]:.6g}", *(f"{value:.9f}" for value in row[1:])]) for row in rows]
    return "\n".join([",".join(head), *lines]) + "\n"


def next_test(proposal: Proposal, file: str) -> records.NextTest:
    """Return the record of a proposal whose commands are in `file`."""
    apart = bool(proposal.rivals)
    return records.NextTest(
        law=_told(proposal.law),
        rivals=tuple(map(_told, proposal.rivals)),
        trajectory=proposal.trajectory.words,
        seconds=proposal.trajectory.seconds,
        file=file,
        distance=proposal.distance if apart else None,
        p_wrong=proposal.p_wrong if apart else None,
        recordings=proposal.recordings,
        sigma=None if math.isnan(proposal.sigma) else proposal.sigma,
        tried=tuple(records.Planned(trajectory=one.words, worth=one.worth) for one in proposal.tried),
    )


def _told(identity: Identity) -> str:
    site = identity.axis or "/".join(identity.channels)
    return f"{identity.law.replace('_', ' ')} ({', '.join(part for part in (identity.port, site) if part)})"
