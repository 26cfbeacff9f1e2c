"""The identification's report is made of its results and tables alone, and shows what a reader needs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from kbs_process.results.records import Check, Conclusion, Provenance, encode
from kbs_process.results.tables import write_table
from kbs_process.studies.documents import render as build
from kbs_process.studies.identify.results import Correlations, Followed, Identified, IdentifyResults, Interval, Misfit

pytestmark = pytest.mark.slow


def number(name: str, group: str, value: float, sigma: float) -> Identified:
    x = value + sigma * np.array([-2.0, -1.0, 0.0, 1.0, 2.1])
    interval = Interval(low=float(x[0]), high=float(x[-1]), x=tuple(x.tolist()), D=(3.9, 1.0, 0.0, 1.1, 3.8))
    return Identified(
        name=name,
        unit="N m",
        group=group,  # type: ignore[arg-type]
        prior=1.2 * value,
        prior_sigma=0.3 * value,
        value=value,
        sigma=sigma,
        interval=interval if group == "critical" else None,
        partner="joint.az.drive.Ts0",
        correlation=-0.97,
        at_bound=False,
    )


def sample() -> IdentifyResults:
    parameters = (
        number("joint.az.drive.tcog", "critical", 6.1e-3, 4e-5),
        number("joint.az.drive.Ts0", "critical", 5.2e-3, 1e-4),
        number("joint.az.drive.d0", "gearbox", 0.012, 3e-4),
        number("body.base.mass", "rig", 8.0, 0.04),
    )
    return IdentifyResults(
        name="BENCH",
        title="Sweeps",
        article="engineering model",
        verdict=Conclusion(status="undecided", sentence="Two identified."),
        provenance=Provenance(
            version="1", python="3", libraries={}, platform="x", command="kbs-process identify BENCH"
        ),
        band_Hz=(0.05, 40.0),
        samples=1000,
        misfit_rms=1.01,
        run_to_run=0.02,
        parameters=parameters,
        starts=(Followed(start_cost=3e5, cost=1.3e5, phases={"joint.az.drive.phi_cog": 1.5}),),
        checks=(Check(name="told apart", ok=False, detail="tcog with Ts0"),),
        misfits=(Misfit(recording="A", role="held-out", channel="Ty", before=12.3, after=1.01),),
        correlations=Correlations(
            names=tuple(p.name for p in parameters[:3]), matrix=((1.0, -0.97, 0.1), (-0.97, 1.0, 0.0), (0.1, 0.0, 1.0))
        ),
        files=("identified/parameters/drives.toml",),
    )


def test_page(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    f = np.linspace(0.01, 50.0, 500)
    spectrum = {"f": f, "Ty.before": 1e-4 / f, "Ty.after": 1e-7 * rng.chisquare(2, 500), "Ty.noise": np.full(500, 1e-7)}
    write_table(tmp_path / "tables/residual_spectrum/A.parquet", spectrum, {"Ty.after": "(N m)^2/Hz"}, recording="A")
    history = {"t": f, "Ty.before": np.sin(f), "Ty.after": 0.01 * rng.standard_normal(500)}
    write_table(tmp_path / "tables/residual/A.parquet", history, {"Ty.after": "N m"}, recording="A")
    (tmp_path / "results.json").write_bytes(encode(sample()))
    page = build(tmp_path, False).read_text()
    for text in ("az.drive.tcog", "12.3", "identified/parameters/drives.toml", "tcog with Ts0", "Profile likelihood"):
        assert text in page
    for figure in (
        "A: spectra of what is unexplained",
        "joint.az: profile likelihood of 2",
        "Correlations of 3 estimates",
    ):
        assert figure in page
    first = (tmp_path / "index.html").read_bytes()
    build(tmp_path, False)
    assert (tmp_path / "index.html").read_bytes() == first
