"""Forces of the laboratory on a rig that its measured motion drives: signatures are what its prediction changes by."""

from __future__ import annotations

from dataclasses import replace

import bench
import numpy as np
import pytest

from kbs_process.diagnosis import direct
from kbs_process.diagnosis.hypothesis import Tapped
from kbs_process.diagnosis.inlets import WRENCH_PORT, Inlet
from kbs_process.diagnosis.signature import inputs
from kbs_process.diagnosis.suspects import Candidate
from kbs_process.plant.attach import attach
from kbs_process.plant.effect import Port
from kbs_process.plant.effects import CATALOGUE
from kbs_process.plant.moved import added_loads
from kbs_process.rig.model import Effort, Rig
from kbs_process.signals.records import Array
from plant.plant_rigs import quantity

RATE = 100.0
GAIN = 2.0


def rig(slides: bool = False) -> Rig:
    """EL089's on a plate that does not give way, with the efforts of both joints recorded."""
    plain = bench.rig()
    effort = Effort("N m", *(quantity("effort", value) for value in (GAIN, 0.0, 0.0, 0.0)))
    az, el = (replace(joint, effort=effort) for joint in plain.joints)
    az = replace(az, type="prismatic") if slides else az
    return replace(plain, joints=(az, el), transducer=replace(plain.transducer, stiffness=None))


def motion() -> tuple[Array, Array]:
    t = np.arange(0.0, 20.0, 1.0 / RATE)
    q = np.stack([0.3 * np.sin(0.4 * t), 1.2 + 0.25 * np.sin(0.7 * t + 1.0)], axis=1)
    return q, np.gradient(q, 1.0 / RATE, axis=0)


@pytest.mark.parametrize("slides", [False, True])
@pytest.mark.parametrize(
    ("name", "site", "point"),
    [
        ("tether", "el", (0.2, 0.1, -0.3)),
        ("tether", "az", (0.2, 0.1, -0.3)),
        ("air_drag", "el", (0.3, -0.1, 0.12)),
        ("ground_cable", "el", None),
        ("ground_cable", "az", None),
    ],
)
def test_a_force_s_signature_is_what_it_adds_to_the_loads(
    name: str, site: str, point: tuple[float, float, float] | None, slides: bool
) -> None:
    law = next(one for one in CATALOGUE if one.name == name)
    here = rig(slides)
    shape = {p.name: p.prior.middle for p in law.parameters if p.role == "shape"}
    candidate = Candidate(law, site, tuple(shape.items()), point)
    q, qd = motion()
    names = [f"{signal}.{joint}" for signal in ("joint_angle", "joint_rate") for joint in here.joint_names]
    columns = inputs(candidate, Tapped(RATE, tuple(names), np.hstack([q, qd])), here, ())
    found = direct.respond(here, columns, q)
    for k, amplitude in enumerate(candidate.amplitudes):
        values = shape | {amplitude.name: 1.0}
        if law.port is Port.EXTERNAL_FORCE:
            acting = attach(here, law, values, on=site, point=np.array(point))
        else:
            acting = attach(here, law, values, joints=[site])
        added = added_loads(acting, [law], q, qd, 1.0 / RATE)
        size = np.max(np.abs(added), axis=0)
        assert size[:6].any()
        # inputs are means from one sample to the next
        assert np.allclose(found[50:-50, :, k], added[50:-50], atol=2e-3 * size.max())


def test_a_torque_in_a_drive_shows_in_its_effort_alone() -> None:
    q, _ = motion()
    column = {Inlet("joint_torque", "el"): np.ones(len(q))}
    found = direct.respond(rig(), [column, {Inlet(WRENCH_PORT, "az", "Tz"): np.full(len(q), np.nan)}], q)
    assert np.allclose(found[50:-50, 7, 0], -1.0 / GAIN, rtol=2e-3)
    assert not np.delete(found[:, :, 0], 7, axis=1).any() and not found[:, :, 1].any()
