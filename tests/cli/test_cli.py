"""The command line as a user meets it: output, errors, exit statuses."""

from __future__ import annotations

import importlib
import json
import re
import shutil
import signal
import subprocess
import sys
import time
from functools import cache
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from campaign.campaign_folder import EXAMPLE, CampaignFolder, make_folder
from end_to_end import short_campaign
from kbs_process import cli
from kbs_process.campaign.load import load_campaign
from kbs_process.errors import RecordingError
from kbs_process.recordings.mcap.messages.encoding import OutStream
from kbs_process.recordings.mcap.writer import write_mcap
from kbs_process.results.outcome import Outcome
from kbs_process.results.store import writing
from kbs_process.rig.model import Rig, substitute
from kbs_process.studies.convert import preset_names

VERBS = ("process", "validate", "inspect", "simulate", "predict", "import", "report", "prove")
RATE = 100.0


def run(*arguments: str) -> int:
    """Run the command line in this process and return its exit status."""
    with pytest.raises(SystemExit) as caught:
        cli.main(arguments)
        sys.exit(0)
    return int(caught.value.code or 0)


@pytest.fixture
def folder(tmp_path: Path) -> CampaignFolder:
    """The example's description with four seconds of recordings."""
    folder = make_folder(tmp_path / "campaigns" / "EL089")
    for path in (folder.path / "recordings").iterdir():
        record(path)
    return folder


def record(path: Path, *, nan: bool = False) -> None:
    """Write four seconds: elevation at 1.3 rad, then moving slowly; a constant wrench, and its noise."""
    stamp = np.arange(400) * 10_000_000
    cycle = np.arange(41) * 100_000_000
    wrench = np.tile([0.0, 0.0, -274.0, -6.0, 5.0, 0.0], (400, 1))
    wrench += 0.01 * np.random.default_rng(1).standard_normal(wrench.shape)
    if nan:
        wrench[200:210, 2] = np.nan
    el = np.clip(np.array([stamp * 1e-9 - 2.0]).T * 1e-3, 0.0, None) + 1.3
    command = np.clip(cycle * 1e-9 - 2.0, 0.0, None) * 1e-3 + 1.3
    rate = np.where(cycle * 1e-9 > 2.0, 1e-3, 0.0)
    zero = np.zeros_like(command)
    write_mcap(
        path,
        [
            OutStream("/transducer/wrench", "wrench", stamp, stamp, wrench),
            OutStream("/encoder", "joints", stamp, stamp, np.hstack([0.0 * el, el]), ("az", "el")),
            OutStream("/command", "joints", cycle, cycle, np.stack([zero, command, zero, rate], axis=1), ("az", "el")),
        ],
    )


@pytest.fixture
def processed(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """Replaces the pipeline; `met` and `error` say how it ends, `called` what it was asked."""
    state = SimpleNamespace(met=True, lossy=False, error=None, called=None)

    def process(campaign: Any, target: Path, *, progress: Any, pdf: bool | None) -> Outcome:
        state.called = (campaign.name, target, pdf)
        if state.error is not None:
            raise state.error
        return Outcome(("torque 0.04 N m, limit 0.06 N m: met",), state.met, target / "index.html", state.lossy)

    importlib.import_module("kbs_process.studies.diagnose.run")  # which the real one is read by
    fake = ModuleType("kbs_process.studies.correlate.run")
    fake.process = process  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, fake.__name__, fake)
    return state


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_explains_itself_with_examples(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(verb, "--help") == 0
    text = capsys.readouterr().out
    assert "Examples:" in text
    assert f"kbs-process {'campaign/EL089' if verb == 'process' else verb}" in text


def test_help_names_every_verb(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("--help") == 0
    text = capsys.readouterr().out
    assert all(f"\n  {verb} " in text for verb in VERBS)


def test_help_is_a_word_too(capsys: pytest.CaptureFixture[str]) -> None:
    told = []
    for words in (("help",), ("--help",), ("help", "simulate"), ("simulate", "--help")):
        assert run(*words) == 0
        told.append(capsys.readouterr().out)
    assert told[0] == told[1] and told[2] == told[3] and told[0] != told[2]


def test_help_tells_exit_statuses_defaults_and_presets(capsys: pytest.CaptureFixture[str]) -> None:
    told = {}
    for verb in ("", "simulate", "flight", "import"):
        assert run(*filter(None, [verb]), "--help") == 0
        told[verb] = " ".join(capsys.readouterr().out.split())
    for status in (cli.NOT_MET, cli.BAD_INPUT, cli.INTERNAL, cli.INTERRUPTED):
        assert f" {status} " in told[""].partition("Exit status:")[2]
    for verb, default in (("simulate", "results/NAME-simulated"), ("flight", "results/NAME-flight")):
        assert f"[default: {default}]" in told[verb]
        assert "the last one listed]" in told[verb]
    assert all(name in told["import"].partition("Presets")[2] for name in preset_names())


@pytest.mark.parametrize("verb", [[], ["import"]])
def test_help_imports_nothing_that_computes(verb: list[str]) -> None:
    code = (
        "import sys\nfrom kbs_process import cli\n"
        f"try:\n    cli.main([*{verb}, '--help'])\nexcept SystemExit:\n    pass\n"
        "print(sorted({name.split('.')[0] for name in sys.modules}), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    heavy = {"numpy", "scipy", "pandas", "pyarrow", "numba", "matplotlib", "rich", "jsonschema", "jinja2", "msgspec"}
    assert not [name for name in heavy if f"'{name}'" in done.stderr]


def test_a_campaign_without_a_verb_is_processed(
    folder: CampaignFolder, processed: SimpleNamespace, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(folder.path.parents[1])
    assert run("campaign/EL089", "--no-diagnose") == 0
    target = folder.path.parents[1] / "results" / "EL089"
    assert processed.called == ("EL089", target, None)
    out = capsys.readouterr().out.splitlines()
    assert out == ["torque 0.04 N m, limit 0.06 N m: met", f"Report: {target / 'index.html'}"]


@pytest.mark.parametrize(
    ("met", "lossy", "options", "status"),
    [
        (True, False, ["--check"], 0),
        (False, True, [], 0),
        (False, False, ["--check"], 1),
        (None, False, ["--check"], 0),
        (True, True, ["--check"], 1),
        (None, True, ["--check"], 1),
    ],
)
def test_a_requirement_not_met_or_a_loss_is_a_status_only_when_asked(
    folder: CampaignFolder, processed: SimpleNamespace, met: bool | None, lossy: bool, options: list[str], status: int
) -> None:
    processed.met, processed.lossy = met, lossy
    assert run(*options, str(folder.path), "-o", str(folder.path.parents[1] / "out"), "--no-pdf") == status
    assert processed.called[1:] == (folder.path.parents[1] / "out", False)


def test_bad_input_is_a_message_and_status_2(
    folder: CampaignFolder, processed: SimpleNamespace, capsys: pytest.CaptureFixture[str]
) -> None:
    processed.error = RecordingError("has no wrench", where="a.mcap", remedy="record one")
    assert run(str(folder.path), "-o", str(folder.path.parents[1] / "out")) == 2
    assert capsys.readouterr().err.endswith("error: a.mcap: has no wrench\n  -> record one\n")


def test_a_fault_of_the_program_is_told_apart(
    folder: CampaignFolder, processed: SimpleNamespace, capsys: pytest.CaptureFixture[str]
) -> None:
    processed.error = ZeroDivisionError("float division by zero")
    arguments = (str(folder.path), "-o", str(folder.path.parents[1] / "out"))
    assert run(*arguments) == cli.INTERNAL
    message = capsys.readouterr().err
    assert "fault of kbs-process" in message
    assert "Traceback" not in message
    with pytest.raises(ZeroDivisionError):
        cli.main([*arguments, "--debug"])


def test_an_interrupt_is_status_130(
    folder: CampaignFolder, processed: SimpleNamespace, capsys: pytest.CaptureFixture[str]
) -> None:
    processed.error = KeyboardInterrupt()
    assert run(str(folder.path), "-o", str(folder.path.parents[1] / "out")) == 130
    assert "interrupted" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("validte", "campaign/EL089"), "did you mean 'validate'?"),
        (("campaign/NOWHERE",), "there is no campaign 'campaign/NOWHERE'"),
        (("validate",), "Missing argument 'CAMPAIGN'"),
        (("inspect", "nowhere.mcap"), "does not exist"),
        (("import",), "Presets: "),
        (("report", "nowhere"), "holds no results"),
        (("campaign/EL089", "--chek"), "No such option"),
    ],
)
def test_wrong_words_are_status_2(arguments: tuple[str, ...], words: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(*arguments) == 2
    message = capsys.readouterr().err
    assert words in message
    assert "Traceback" not in message


def test_validate_of_what_was_begun_is_json_where_that_is_asked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    said = ["complete", "import"]
    monkeypatch.setattr("kbs_process.studies.convert.begin.check_description", lambda folder: iter(said))
    for name in ("campaign", "mapping"):
        (tmp_path / f"{name}.toml").touch()
    assert run("validate", str(tmp_path), "--json") == 0
    assert json.loads(capsys.readouterr().out) == said


@pytest.fixture
def processable(tmp_path: Path) -> CampaignFolder:
    """The example's description with recordings of its rig that are long enough for the gravity fit."""
    folder = make_folder(tmp_path / "campaigns" / "EL089")
    for number, path in enumerate(sorted((folder.path / "recordings").iterdir())):
        short_campaign.record(path, noise=rig().transducer.noise.value, seed=number, rig=rig())
    return folder


@cache
def rig() -> Rig:
    return load_campaign(EXAMPLE, checksums=False).rig


@pytest.mark.slow
def test_validate_finds_sound_recordings_clean(processable: CampaignFolder, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("validate", str(processable.path), "--check") == 0
    out = capsys.readouterr().out
    assert "EL089P00_1  fit          clean" in out
    assert "wrench 100 Hz" in out
    assert "4 recordings: 0 refused, 0 with losses" in out


@pytest.mark.slow
def test_validate_tells_losses_and_fails_only_when_asked(
    processable: CampaignFolder, capsys: pytest.CaptureFixture[str]
) -> None:
    short_campaign.record(
        processable.path / "recordings" / "EL089P00_2.mcap",
        noise=rig().transducer.noise.value,
        seed=5,
        nan=slice(200, 210),
        rig=rig(),
    )
    assert run("validate", str(processable.path)) == 0
    assert run("validate", str(processable.path), "--check") == 1
    out = capsys.readouterr().out
    assert "EL089P00_2  held-out     lossy" in out
    assert "EL089P00_3  held-out     clean" in out


@pytest.mark.slow
def test_validate_of_a_wrong_model_fails_when_asked(
    processable: CampaignFolder, capsys: pytest.CaptureFixture[str]
) -> None:
    heavy = substitute(rig(), {"body.base.mass": rig().quantities()["body.base.mass"].value + 20.0})
    for seed, path in enumerate((processable.path / "recordings").iterdir()):
        short_campaign.record(path, noise=rig().transducer.noise.value, seed=seed, rig=heavy)
    assert run("validate", str(processable.path), "--check") == 1
    out = capsys.readouterr().out
    assert "error: the model of this rig is wrong" in out
    assert "0 with losses" in out


@pytest.mark.slow
def test_validate_tells_what_was_put_in_order_and_counts_no_loss(
    processable: CampaignFolder, capsys: pytest.CaptureFixture[str]
) -> None:
    short_campaign.record(
        processable.path / "recordings" / "EL089P00_2.mcap",
        noise=rig().transducer.noise.value,
        seed=5,
        swapped=True,
        rig=rig(),
    )
    assert run("validate", str(processable.path), "--check") == 0
    out = capsys.readouterr().out
    assert "EL089P00_2  held-out     clean" in out
    assert "EL089P00_2: 1 x put in order" in out
    assert "4 recordings: 0 refused, 0 with losses" in out


@pytest.mark.slow
def test_validate_tells_a_recording_of_which_nothing_is_whole_long_enough(
    processable: CampaignFolder, capsys: pytest.CaptureFixture[str]
) -> None:
    """Gravity is not fitted to a recording that is held out, and processing has to take it off all the same."""
    path = processable.path / "recordings" / "EL089P00_2.mcap"
    lost = np.flatnonzero(np.arange(2000) % 80 < 60)  # 0.6 s of every 0.8 s
    short_campaign.record(path, noise=rig().transducer.noise.value, seed=5, nan=lost, rig=rig())
    assert run("validate", str(processable.path), "-q") == 2
    out = capsys.readouterr().out
    assert "EL089P00_2: too short or too damaged" in out
    assert "s of 20 s, by 1500 x non-finite" in out


@pytest.mark.slow
@pytest.mark.parametrize(
    ("trajectories", "hinted"),
    [
        ({}, ""),
        ({"EL089P00_2": "B", "EL089P00_3": "C"}, "no repeatability, and diagnose takes"),
        # A calibration is in the floor, and in no budget.
        ({"EL089P00_1": "AZPS_ATA", "EL089P00_2": "B", "EL089P00_3": "C"}, "no repeatability\n"),
    ],
)
def test_validate_hints_at_a_campaign_without_repeats(
    processable: CampaignFolder, capsys: pytest.CaptureFixture[str], trajectories: dict[str, str], hinted: str
) -> None:
    text = (processable.path / "campaign.toml").read_text()
    for number, (name, trajectory) in enumerate(trajectories.items(), start=11):
        head, tail = text.split(f"recordings/{name}.mcap")
        tail = tail.replace('trajectory = "EL089P00"', f'trajectory = "{trajectory}"', 1)
        tail = re.sub(r"repeat = \d+", f"repeat = {number}", tail, count=1)
        text = f"{head}recordings/{name}.mcap{tail}"
    (processable.path / "campaign.toml").write_text(text)
    assert run("validate", str(processable.path), "-q") == 0
    out = capsys.readouterr().out
    assert ("hint: no trajectory is repeated" in out) == bool(hinted)
    assert hinted in out


@pytest.mark.slow
def test_validate_plans_the_day_of_a_campaign_without_recordings(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "REFDAY"
    shutil.copytree(EXAMPLE.parent / "REFDAY", folder)
    assert run("validate", str(folder), "--check", "-q") == 0
    said = capsys.readouterr().out
    assert "0 recordings" in said and "mission: 14600 s in 9 sections, 3 slews" in said
    path = folder / "mission.toml"
    path.write_text(path.read_text().replace("100000, unit", "30000000, unit"))
    assert run("validate", str(folder), "-q") == 2
    assert "no relay satellite can be tracked at the beginning" in capsys.readouterr().out


def test_validate_refuses_what_it_cannot_read(folder: CampaignFolder, capsys: pytest.CaptureFixture[str]) -> None:
    (folder.path / "recordings" / "EL089P00_2.mcap").write_bytes(b"")
    folder.replace("campaign.toml", 'wrench = "/transducer/wrench"', 'wrench = "/transducer/wrnch"')
    assert run("validate", str(folder.path), "-q") == 2
    out = capsys.readouterr().out
    assert "the file is empty" in out
    assert "did you mean '/transducer/wrench'?" in out
    assert "4 refused" in out
    assert "cannot be processed" not in out


@pytest.mark.parametrize("fault", ["two channels of a force", "too short"])
def test_validate_tells_what_processing_refuses_in_the_same_words(
    folder: CampaignFolder, capsys: pytest.CaptureFixture[str], fault: str
) -> None:
    if fault != "too short":
        folder.replace("parameters/rig.toml", '["Fx", "Fy", "Fz", "Tx", "Ty", "Tz"]', '["Fx", "Fy"]')
    assert run("validate", str(folder.path), "-q") == 2
    listed = capsys.readouterr().out
    target = folder.path.parents[1] / "out"
    assert run(str(folder.path), "-o", str(target), "--no-diagnose", "--no-pdf", "-q") == 2
    refused = capsys.readouterr().err.removeprefix("error: ")
    assert f"cannot be processed: {refused}" in listed
    assert ("nothing was measured in frame S" if fault != "too short" else "too short") in refused
    assert not target.exists()


def test_inspect_shows_what_is_in_a_recording(folder: CampaignFolder, capsys: pytest.CaptureFixture[str]) -> None:
    path = folder.path / "recordings" / "EL089P00_1.mcap"
    assert run("inspect", str(path)) == 0
    out = capsys.readouterr().out
    assert f"{path}: clean" in out
    assert "/transducer/wrench  geometry_msgs/msg/WrenchStamped  cdr" in out
    assert "400 messages at 100 Hz, 3.990 s" in out
    (line,) = [line for line in out.splitlines() if "wrench.force.z" in line]
    low, _, high = line.split()[1:]
    assert -274.1 < float(low) < -274.0 < float(high) < -273.9


def test_inspect_tells_an_unreadable_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "a.mcap").write_bytes(b"PK\x03\x04" * 100)
    assert run("inspect", str(tmp_path / "a.mcap")) == 2
    assert "unreadable" in capsys.readouterr().out


def test_predict_writes_what_reads_back(
    folder: CampaignFolder, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "predicted"
    assert run("predict", str(folder.path), "EL089P00_1", "-o", str(target)) == 0
    table = pq.read_table(target / "wrench.parquet")
    about = json.loads(table.schema.metadata[b"kbs"])
    assert about["frame"] == "T"
    assert about["units"]["Tz"] == "N m"
    assert table.num_rows == 400
    weight = (8.0 + 6.0 + 14.0) * 9.80665
    np.testing.assert_allclose(table["Fz"].to_numpy(), -weight, rtol=1e-3)
    assert run("inspect", str(target / "predicted.mcap")) == 0
    assert "/transducer/wrench" in capsys.readouterr().out
    # Once more: the same bytes, in the place of the old ones.
    before = {path.name: path.read_bytes() for path in target.iterdir()}
    assert run("predict", str(folder.path), "EL089P00_1", "-o", str(target)) == 0
    assert {path.name: path.read_bytes() for path in target.iterdir()} == before


def test_simulate_a_command_file(folder: CampaignFolder, tmp_path: Path) -> None:
    t = np.arange(0.0, 3.01, 0.1)
    rows = [f"{time:.1f},0.0,{1.3 + 1e-3 * max(0.0, time - 1.0):.6f}" for time in t]
    (tmp_path / "slew.csv").write_text("t,az,el\n" + "\n".join(rows) + "\n")
    target = tmp_path / "simulated"
    arguments = ("simulate", str(folder.path), "--command", str(tmp_path / "slew.csv"), "--rate", "50")
    assert run(*arguments, "-o", str(target)) == 0
    angle = pq.read_table(target / "angle.parquet")
    assert angle.num_rows == 150
    # The joint goes where it is told, within one code of its encoder and the flexspline's sag under gravity.
    assert angle["el"].to_numpy()[-1] == pytest.approx(1.302, abs=2e-3)


@pytest.mark.slow
def test_an_interrupted_simulation_leaves_the_old_one(folder: CampaignFolder, tmp_path: Path) -> None:
    target = tmp_path / "simulated"
    with writing(target) as private:
        (private / "simulated.mcap").write_text("old")
    (tmp_path / "long.csv").write_text("t,az,el\n0,0,1.3\n1,0,1.3\n20000,0,1.31\n")
    command = [sys.executable, "-m", "kbs_process", "simulate", str(folder.path), "-o", str(target)]
    process = subprocess.Popen(
        [*command, "--command", str(tmp_path / "long.csv")], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stderr is not None
    assert process.stderr.readline() == "Simulating 2e+04 s of long\n"
    while process.poll() is None and not list(tmp_path.glob(".simulated.new-*")):
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    _, message = process.communicate(timeout=120)
    assert process.returncode == 130, message
    assert "interrupted" in message
    assert (target / "simulated.mcap").read_text() == "old"
    assert not list(tmp_path.glob(".simulated.new-*"))


def test_a_command_file_without_a_joint_is_refused(
    folder: CampaignFolder, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "slew.csv").write_text("t,az,elevation\n0,0,1\n0.1,0,1\n")
    arguments = ("simulate", str(folder.path), "--command", str(tmp_path / "slew.csv"))
    assert run(*arguments, "-o", str(tmp_path / "out")) == 2
    assert "has no column 'el'" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_simulate_an_unknown_trajectory(folder: CampaignFolder, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("simulate", str(folder.path), "--trajectory", "EL089P01") == 2
    assert "did you mean 'EL089P00'?" in capsys.readouterr().err


MOTION_DRIVEN = """
schema = 1
name = "BENCH"
title = "Angles alone"
drive = "motion"
[bands]
high_pass_Hz = 0.0
low_pass_Hz = [2.0]
working_rate_Hz = 20.0
[topics]
wrench = "/transducer/wrench"
encoder = "/encoder"
[parameters]
files = ["parameters/rig.toml"]
[[recording]]
file = "recordings/EL089P00_1.mcap"
trajectory = "EL089P00"
role = "fit"
"""


def test_predict_from_measured_motion(folder: CampaignFolder, tmp_path: Path) -> None:
    """Without a drive or a controller, the wrench is that of the bodies in the angles measured."""
    (folder.path / "campaign.toml").write_text(MOTION_DRIVEN)
    assert run("predict", str(folder.path), "EL089P00_1", "-o", str(tmp_path / "out")) == 0
    wrench = pq.read_table(tmp_path / "out" / "wrench.parquet")
    np.testing.assert_allclose(wrench["Fz"].to_numpy(), -28.0 * 9.80665, rtol=1e-3)


def test_there_is_nothing_to_simulate_without_commands(
    folder: CampaignFolder, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder.path / "campaign.toml").write_text(MOTION_DRIVEN)
    assert run("simulate", str(folder.path)) == 2
    assert "use 'predict'" in capsys.readouterr().err


def test_results_never_go_into_the_campaign(folder: CampaignFolder, capsys: pytest.CaptureFixture[str]) -> None:
    before = sorted(folder.path.rglob("*"))
    assert run("predict", str(folder.path), "EL089P00_1", "-o", str(folder.path / "out")) == 2
    assert "campaign's folder" in capsys.readouterr().err
    assert sorted(folder.path.rglob("*")) == before


def test_the_installed_command_runs() -> None:
    command = [sys.executable, "-m", "kbs_process", "--version"]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=EXAMPLE)
    assert done.stdout.startswith("kbs-process, version ")


def test_output_that_finds_no_room_is_told() -> None:
    command = [sys.executable, "-m", "kbs_process", "schema", "correlation"]
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 2 and done.stderr.startswith("error: what is printed cannot be written"), done.stderr


def test_inspect_and_validate_speak_to_programs(folder: CampaignFolder, capsys: pytest.CaptureFixture[str]) -> None:
    recording = next((folder.path / "recordings").iterdir())
    assert run("inspect", "--json", str(recording)) == 0
    (one,) = json.loads(capsys.readouterr().out)
    assert (one["state"], one["path"]) == ("clean", str(recording))
    assert {topic["topic"]: topic["count"] for topic in one["topics"]}["/transducer/wrench"] == 400
    assert run("validate", "--json", "-q", str(folder.path)) in (0, 2)
    findings = json.loads(capsys.readouterr().out)["findings"]
    assert {one["name"] for one in findings} == {path.stem for path in (folder.path / "recordings").iterdir()}


def test_a_schema_is_printed_or_its_name_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("schema", "import") == 0
    assert json.loads(capsys.readouterr().out)["title"].startswith("mapping")
    assert run("schema", "campain") == cli.BAD_INPUT
    assert "did you mean 'campaign'?" in capsys.readouterr().err
