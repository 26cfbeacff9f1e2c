"""The page: complete, self-contained, safe, small, and always the same."""

from __future__ import annotations

import base64
import hashlib
import json
import os
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import pytest

from kbs_process.errors import OutputError
from kbs_process.report import build as paper
from kbs_process.results.records import encode
from kbs_process.studies.documents import render as build
from report import sample

pytestmark = pytest.mark.slow  # every figure of a page is drawn

HOSTILE = '<script>alert("x")</script>&$\\frac{1}$"onerror="alert(1)'


class Page(HTMLParser):
    """Collects elements, attributes, styles, scripts and visible text."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.inline: dict[str, list[str]] = {"style": [], "script": []}
        self.data: list[str] = []
        self.words: list[str] = []
        self._open = ""
        self._json = False
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        self._open = tag
        self._json = ("type", "application/json") in attrs

    def handle_data(self, data: str) -> None:
        if self._open in self.inline:
            (self.data if self._json else self.inline[self._open]).append(data)
        else:
            self.words.append(data)

    def handle_endtag(self, tag: str) -> None:
        self._open = ""

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.words).replace("\u00a0", " ").split())

    def all(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.elements if name == tag]


@pytest.fixture(scope="module")
def page(six_channels: Path) -> Page:
    return Page(six_channels.read_text(encoding="utf-8"))


def test_the_verdict_comes_first_with_what_qualifies_it(page: Page) -> None:
    expected = [
        "Pass",
        "Model correlated The prediction explains 87 % of the variance of Ty.",
        "0.0412 N m 0.0273 to 0.0474 N m 0.06 N m 0.0188 N m (31 %)",
        "0 errors · 2 warnings · 1 data loss in 1 of 3 runs · 0 of 3 sign and frame self-tests failed.",
        "412 samples of /transducer/wrench are missing",
        "Torque fluctuations are taken to arise in the motor gears",
        "Figures of merit",
    ]
    start = page.text.find("command-driven prediction")
    places = [page.text.find(entry, start) for entry in expected]
    assert -1 not in places
    assert places == sorted(places)


@pytest.mark.parametrize(
    "said",
    [
        "Document TR-089 Revision B Date of test 1995-06-15 Operator A. Tester Processed with kbs-process",
        ", commit 0123456789ab",
        "Tested by A. Tester Checked by Approved by",
        "Tx / N m",
        "EL089P00_2",
        "held-out",
        "2.710 ± 0.080 Hz",
        "body.antenna.cog[z]",
        "Standard uncertainties, EL089P00_2, below 1 Hz, spacecraft (S)",
        "Other recordings",
        "Computed gravity compensation is feasible",
        "Residual after each part of the model",
        "and tilt",
        "Is the prediction pessimistic?",
        "Section 8, line by line",
        "Peak torque at the spacecraft from all six channels at once, below 1 Hz",
        "0.0032 ± 0.0011",
        "11 something else pulls",
        "The largest coupling takes 0.9 N m",
        "encoder quantisation and noise",
        "63.200 to 63.612 s",
        "Fz < 0 at rest",
        "zero-phase Butterworth of order 4",
        "6.50 s",
        "Kaiser FIR",
        "10000 ± 500",
        "kbs-process campaign/EL089",
        "a" * 64,
        "0123456789abcdef0123456789abcdef01234567",
    ],
)
def test_everything_in_the_results_is_shown(page: Page, said: str) -> None:
    assert said in page.text


def test_every_figure_says_how_to_read_it(page: Page) -> None:
    figures = len(page.all("figure"))
    assert figures >= 9
    for word in ("Shown", "Good", "Bad", "Do"):
        assert page.words.count(word) == figures
    assert all(image["alt"] for image in page.all("img"))


def test_every_recording_band_and_frame_is_in_the_interactive_figure(page: Page) -> None:
    disturbance, spectra, static = (json.loads(content) for content in page.data)
    assert len(disturbance["views"]) == 2 * 3 * 2
    for live in (spectra, static):
        assert {view["recording"] for view in live["views"]} == {name for name, *_ in sample.RUNS}
    first = disturbance["views"][0]
    assert (first["recording"], first["choice"]) == ("EL089P00_2", "below 1 Hz, spacecraft (S)")
    assert [channel["name"] for channel in first["channels"]] == list(sample.CHANNELS)
    assert [channel["limit"] for channel in first["channels"]] == [None] * 3 + [0.06] * 3
    assert first["shaded"][0][0] == 0.0


def test_the_torques_at_the_transducer_are_drawn_in_every_band(page: Page) -> None:
    drawn = [str(image["alt"]) for image in page.all("img")]
    for band in ("below 1 Hz", "below 2 Hz", "unfiltered"):
        assert any(f"EL089P00_2, {band}, transducer (T): measured and predicted" in alt for alt in drawn)


def test_nothing_is_loaded_from_elsewhere(page: Page) -> None:
    assert not page.all("link")
    assert not page.all("iframe")
    assert all("src" not in script for script in page.all("script"))
    assert all(str(image["src"]).startswith("data:image/") for image in page.all("img"))
    assert all(str(anchor["href"]).startswith("#") for anchor in page.all("a"))
    assert not re.search(r"url\(|@import", "".join(page.inline["style"]))
    assert not any("style" in attributes for _, attributes in page.elements)


def test_the_policy_allows_the_pages_own_code_and_nothing_else(page: Page) -> None:
    policy = next(
        str(entry["content"]) for entry in page.all("meta") if entry.get("http-equiv") == "Content-Security-Policy"
    )
    rules = dict(rule.split(" ", 1) for rule in policy.split("; "))
    assert rules["default-src"] == "'none'"
    assert "unsafe" not in policy
    for kind in ("style", "script"):
        digest = base64.b64encode(hashlib.sha256("".join(page.inline[kind]).encode()).digest()).decode()
        assert rules[f"{kind}-src"] == f"'sha256-{digest}'"


def test_the_page_is_small(six_channels: Path) -> None:
    assert six_channels.stat().st_size < 10e6


def test_a_motion_driven_rig_with_one_channel_is_reported_too(one_channel: Path) -> None:
    page = Page(one_channel.read_text(encoding="utf-8"))
    for said in (
        "No requirement",
        "motion-driven prediction",
        "states no requirement",
        "Nothing was fitted",
        "channels are taken as independent",
        "No trajectory was recorded more than once",
        "Tz / N m",
    ):
        assert said in page.text
    assert "spacecraft" not in page.text


def test_results_without_tables_are_reported_too(tmp_path: Path) -> None:
    (tmp_path / "results.json").write_bytes(encode(sample.command_results()))
    text = Page(build(tmp_path, pdf=False).read_text(encoding="utf-8")).text
    assert "No band table to show." in text
    assert "No recording has a spectrum table." in text


def test_hostile_names_stay_text(tmp_path: Path) -> None:
    content = encode(sample.command_results()).decode()
    for name in ("EL089P00_2", "about y", "Ty", "body.antenna.mass", "drop", "below 1 Hz"):
        content = content.replace(json.dumps(name), json.dumps(HOSTILE + name))
    (tmp_path / "results.json").write_text(content.replace("engineering model", json.dumps(HOSTILE)[1:-1]))
    html = build(tmp_path, pdf=False).read_text(encoding="utf-8")
    page = Page(html)
    assert html.count("<script") == len(page.all("script")) == 1
    assert not any(key.startswith("on") for _, attributes in page.elements for key in attributes)
    assert HOSTILE in page.text


def test_hostile_data_cannot_leave_its_script_element(tmp_path: Path) -> None:
    folder = sample.one_channel(tmp_path)
    content = json.loads((folder / "results.json").read_text())
    content["bands"][0]["label"] = "</script><img src=x onerror=alert(1)>"
    (folder / "results.json").write_text(json.dumps(content))
    page = Page(build(folder, pdf=False).read_text(encoding="utf-8"))
    assert json.loads(page.data[0])["views"][0]["choice"].startswith("</script><img")
    assert all(str(image["src"]).startswith("data:") for image in page.all("img"))


@pytest.mark.slow
def test_the_same_results_give_the_same_bytes_in_another_process(one_channel: Path, tmp_path: Path) -> None:
    folder = sample.one_channel(tmp_path)
    code = "import sys, pathlib; from kbs_process.studies.documents import render; render(pathlib.Path(sys.argv[1]))"
    subprocess.run([sys.executable, "-c", code, folder], check=True, env={**os.environ, "PYTHONHASHSEED": "2"})
    assert (folder / "index.html").read_bytes() == one_channel.read_bytes()
    if paper.available():
        other = (folder / "report.pdf").read_bytes()
        build(folder, pdf=True)
        assert (folder / "report.pdf").read_bytes() == other
        assert other.startswith(b"%PDF-")
        assert other.rstrip().endswith(b"%%EOF")


def test_a_demanded_pdf_without_weasyprint_is_refused(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "results.json").write_bytes(encode(sample.command_results()))
    monkeypatch.setitem(sys.modules, "weasyprint", None)
    with pytest.raises(OutputError, match="no PDF without weasyprint") as caught:
        build(tmp_path, pdf=True)
    assert "pip install" in caught.value.remedy


def test_a_table_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    folder = sample.one_channel(tmp_path)
    broken = folder / "tables" / "gravity" / "trial_02.parquet"
    broken.write_bytes(broken.read_bytes()[:500])
    with pytest.raises(OutputError, match=r"trial_02\.parquet"):
        build(folder, pdf=False)


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "results.json").write_bytes(encode(sample.command_results()))
    (tmp_path / "index.html").mkdir()
    with pytest.raises(OutputError, match=r"cannot write the report"):
        build(tmp_path, pdf=False)
    assert not list(tmp_path.glob("*.part"))
