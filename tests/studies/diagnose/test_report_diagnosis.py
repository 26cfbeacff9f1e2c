"""The diagnosis' page: what is known is on it, and what is not is said."""

from __future__ import annotations

import re
from pathlib import Path
from typing import get_args

import msgspec
import numpy as np

from kbs_process.diagnosis.facts import Answer, Moved, Place
from kbs_process.results.records import Check, Conclusion, encode
from kbs_process.results.tables import write_table
from kbs_process.studies.diagnose import results as d
from kbs_process.studies.documents import render as build
from report import sample


def trial(name: str, role: str, corrected: float) -> d.Trial:
    return msgspec.convert(
        {
            "recording": name,
            "trajectory": "SWEEP",
            "role": role,
            "nominal": 8.0,
            "known": 3.0,
            "corrected": corrected,
            "channels": {"Tx": corrected, "Ty": 1.3, "el": 0.98},
        },
        d.Trial,
    )


def find() -> d.Find:
    x = np.linspace(1.2, 1.5, 40)
    place = Place(port="joint torque", site="el", channels=("el", "Ty"))
    return d.Find(
        name="harness",
        family="harness",
        named=True,
        place=place,
        equation=r"$T = -k (\theta_l - \theta_0)$ at the joint.",
        reference="harness handbook",
        parameters=(d.Fitted(name="k_harness", unit="N m/rad", value=0.8, sigma=0.05, low=0.7, high=0.9),),
        probability=0.93,
        distance=310.0,
        absorbed=0.2,
        rivals=(d.Rival(name="dahl", family="friction", place=place, distance=2.1, probability=0.06, simulated=True),),
        gate=(d.Gated(recording="run_2", role="held-out", before=3.0, after=1.02, gain=900.0),),
        curve=d.Curve(
            regressor="angle of el",
            x_unit="rad",
            y_unit="N m",
            x=tuple(x.tolist()),
            y=tuple((-0.8 * (x - 1.2)).tolist()),
            sigma=(0.02,) * len(x),
            fitted=tuple((-0.81 * (x - 1.2)).tolist()),
        ),
    )


def results(*finds: d.Find) -> d.DiagnosisResults:
    return d.DiagnosisResults(
        name="RIG<7>",
        title="A rig",
        article="an article",
        verdict=Conclusion(status="none", sentence="Left out: harness in el."),
        provenance=sample.PROVENANCE,
        answer="physics",
        paragraph="Prediction and recordings differ by 3.0 times what repeats differ by.",
        floor="from 3 repeats",
        log10_p=-220.0,
        moved=(
            Moved(
                name="joint.el.drive.Ka",
                unit="N m/rad",
                prior=1e4,
                prior_sigma=1e3,
                value=1.4e4,
                sigma=80.0,
                sigmas=4.0,
            ),
        ),
        finds=finds,
        trials=(trial("run_1", "fit", 1.01), trial("run_2", "held-out", 1.02)),
        ports=(d.PortTest(port="joint torque el", log10_p=-0.2, sufficient=True, share=0.99),),
        suspects=(
            d.Suspect(
                name="harness",
                family="harness",
                place=Place(port="joint torque", site="el"),
                distance=310.0,
                absorbed=0.2,
                outcome="accepted",
            ),
        ),
        checks=(Check(name="converged", ok=True, detail="3 steps"),),
    )  # fmt: skip


def page(folder: Path, found: d.DiagnosisResults) -> str:
    folder.mkdir(exist_ok=True)
    (folder / "results.json").write_bytes(encode(found))
    return re.sub(r"data:image[^\"]*", "", build(folder, pdf=False).read_text())


def test_a_find_is_told_with_its_law_its_gate_and_its_rivals(tmp_path: Path) -> None:
    text = page(tmp_path, results(find()))
    for said in (
        r'aria-label="T = -k (\theta_l - \theta_0)"',
        " at the joint.",
        "Source: harness handbook.",
        "k_harness",
        "0.7000 to 0.9000",
        "dahl",
        "run_2",
        "10⁻²²⁰",
        "joint.el.drive.Ka",
    ):
        assert said in text.replace("\u00a0", " "), said
    assert "$" not in re.sub(r"<(script|style)>.*?</\1>", "", text, flags=re.DOTALL)
    assert "RIG&lt;7&gt;" in text


def test_nothing_found_is_said(tmp_path: Path) -> None:
    assert "No effect passed the acceptance test" in page(tmp_path, results())


def test_it_is_headed_by_its_answer(tmp_path: Path) -> None:
    headings = {
        "none": "No mismatch",
        "parameters off": "Parameters off",
        "physics": "Physics left out",
        "undecided": "Undecided",
    }
    assert set(headings) == set(get_args(Answer))
    for answer, heading in headings.items():
        text = page(tmp_path / heading, msgspec.structs.replace(results(), answer=answer))
        assert re.findall("<strong>(.*?)</strong>", text)[:1] == [heading]


def next_test(**changed: object) -> d.NextTest:
    given = {
        "law": "harness (joint torque, el)",
        "rivals": ("dahl (joint torque, el)",),
        "trajectory": "el: scans of the whole range at 0.2 deg/s",
        "seconds": 200.0,
        "file": "next-test.csv",
        "distance": 3.1,
        "p_wrong": 0.06,
        "recordings": 3,
        "sigma": None,
        "tried": ({"trajectory": "el: scans of the whole range at 0.2 deg/s", "worth": 3.4},),
    }
    return msgspec.convert(given | changed, d.NextTest)


def test_the_next_test_is_told_with_its_power(tmp_path: Path) -> None:
    told = page(tmp_path / "rivals", msgspec.structs.replace(results(find()), next_test=next_test()))
    for said in ("next-test.csv", "3.1", "6.0 %", "3 recordings", "do not distinguish harness"):
        assert said in told.replace("\u00a0", " "), said
    weak = next_test(rivals=(), distance=None, p_wrong=None, recordings=1, sigma=0.25)
    told = page(tmp_path / "weak", msgspec.structs.replace(results(find()), next_test=weak))
    assert "25 % of its present sigma" in told.replace("\u00a0", " ")


def test_where_the_residual_lives_is_a_map_of_each_trajectory(tmp_path: Path) -> None:
    t, f = (grid.ravel() for grid in np.meshgrid(np.arange(8.0, 80.0, 16.0), np.arange(0.1, 8.0, 0.125)))
    size = np.ones(len(t))
    columns = {"t": t, "f": f, "before": 1.0 + 9.0 * (f > 5.0), "after": size, "significant": f > 5.0}
    columns = {name: np.asarray(values, dtype=float) for name, values in columns.items()}
    units = dict.fromkeys(columns, "1")
    write_table(tmp_path / "tables" / "residual_map" / "SWEEP.parquet", columns, units, frame="T", recording="run_1")
    told = page(tmp_path, results(find()))
    assert "Where the residual is" in told
    assert "before at most 10" in told.replace("\u00a0", " ")


def test_a_report_tells_of_a_diagnosis_by_another_version(tmp_path: Path) -> None:
    folder = sample.one_channel(tmp_path / "out")
    made = msgspec.structs.replace(sample.PROVENANCE, commit="0123456")
    other = "by another version of kbs-process"
    for provenance, said in ((sample.PROVENANCE, False), (made, True)):
        page(folder / "diagnosis", msgspec.structs.replace(results(), provenance=provenance))
        assert (other in build(folder, pdf=False).read_text().replace("\u00a0", " ")) is said


def test_code_without_a_commit_is_named_by_its_files(tmp_path: Path) -> None:
    made = msgspec.structs.replace(sample.PROVENANCE, commit="", source="c0ffee")
    told = page(tmp_path, msgspec.structs.replace(results(), provenance=made)).replace("\u00a0", " ")
    assert "source, SHA-256" in told and "c0ffee" in told
