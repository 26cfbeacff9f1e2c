"""What a diagnosis leaves on disk: results that read back, a page, tables, a model that loads, the next test."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pyarrow.parquet as pq
import pytest

from diagnosis import bench
from diagnosis.selection.test_rounds import standing
from kbs_process.campaign.load import load_campaign
from kbs_process.diagnosis.acceptance.finding import _alike_likely, merged, trusted
from kbs_process.diagnosis.acceptance.gate import Fold, Gate
from kbs_process.diagnosis.acceptance.outcome import Absorbed, Alternative, Curve, Find, Outcome, Refused
from kbs_process.diagnosis.experiments.floor import declared
from kbs_process.diagnosis.facts import Estimate, Identity, Moved, Place, Planned
from kbs_process.diagnosis.nominal.detection import Detection
from kbs_process.diagnosis.nominal.joint import standing_of
from kbs_process.diagnosis.nominal.known import MOVED, NEAR, Strain
from kbs_process.diagnosis.proposing.curves import basis
from kbs_process.diagnosis.proposing.measured import inserted
from kbs_process.diagnosis.selection.next_test import Proposal
from kbs_process.diagnosis.selection.trajectories import family, limits_of
from kbs_process.plant.laws.position.measured_law import COEFFICIENTS, MEASURED
from kbs_process.reduction.commands import read_commands
from kbs_process.results.outcome import Outcome as Told
from kbs_process.results.records import load
from kbs_process.studies.diagnose import output
from kbs_process.studies.diagnose.corrected import write_corrected
from kbs_process.studies.diagnose.output import write_diagnosis
from kbs_process.studies.diagnose.prose import answer, law_in_words, paragraph
from kbs_process.studies.diagnose.results import DiagnosisResults, Fitted, Trial
from kbs_process.studies.diagnose.written import shown_by

pytestmark = pytest.mark.slow

OVER_ANGLE = next(one for one in MEASURED if one.effect.name == "ground_angle_law")
LAW = Identity(Place("external wrench", "el"), "unnamed", "curve over joint angle")
CABLE = Identity(Place("external wrench", "el"), "cable", "ground_cable")
DRAG = Identity(Place("joint torque", "el"), "friction", "joint_viscous")
FLOOR = declared(bench.experiment(bench.rig(), ("fit",), 4))
NOTHING = Detection((), -1.0, 1.0)
OFF = Moved(name="joint.el.drive.Ka", unit="N m/rad", prior=0.5, prior_sigma=0.1, value=1.0, sigma=0.1, sigmas=5.0)
NODES, SIGMA = np.full(COEFFICIENTS, 0.5), np.full(COEFFICIENTS, 0.01)


def disc(like: Find, order: float, tag: str) -> Find:
    """An eccentric disc that was found with one order; of a second find the numbers are tagged."""
    own = Identity(Place("encoder", "el"), "eccentricity", "encoder_eccentricity")
    values = {"eccentric_sin": 1e-4 * order, "eccentric_cos": 0.0, "eccentric_order": order}
    told = tuple(Estimate(f"{name}{tag}", "", value, 1e-6) for name, value in values.items())
    return replace(like, identity=own, estimates=told, curve=None)


@pytest.fixture(scope="module")
def outcome() -> Outcome:
    """A curve was found, inside the plant; a cable was not refused by these recordings."""
    before = standing(bench.experiment(bench.rig(), ("fit", "held-out"), 4))
    known = before.known
    ends = (1.25, 1.30)
    hypothesis, scalars = inserted(before.hypothesis, OVER_ANGLE, "el", ends, NODES, SIGMA)
    spread = np.diag(np.concatenate([np.diag(known.covariance), SIGMA**2]))
    found = replace(
        known,
        hypothesis=hypothesis,
        free=(*known.free, *scalars),
        value=np.concatenate([known.value, NODES]),
        covariance=spread,
        parameters=known.parameters.extended(
            [one.name for one in scalars], np.zeros(COEFFICIENTS), np.full(COEFFICIENTS, np.inf), -np.inf, np.inf
        ),
    )
    x = np.linspace(*ends, 101)
    find = Find(
        identity=LAW,
        named=False,
        equation="cubic spline",
        reference="measured",
        estimates=tuple(Estimate(one.name.rpartition(".")[2], "", 0.5, 0.01) for one in scalars),
        probability=0.9,
        rho_eff=30.0,
        kappa=0.1,
        gate=Gate(True, (Fold("r1", 9.0, 1.0, 100.0),), True, 30.0, (2.0, 1.0), ()),
        alternatives=(Alternative(CABLE, 0.1, 2.0, True, True),),
        ports_alike=(),
        held_out_variance=0.95,
        curve=Curve(OVER_ANGLE, x, basis(OVER_ANGLE, x, *ends), np.linspace(0.6, 0.4, 101), np.full(101, 0.01)),
    )
    return Outcome(
        before=NOTHING,
        after=NOTHING,
        held_out=None,
        log_p=-80.0,
        moved=(),
        finds=(find,),
        refused=(Refused(DRAG, 29.0, ("no",)), Refused(CABLE, 28.0, ("r1 predicted no better",), 1.21)),
        absorbed=(Absorbed(DRAG, 0.999, 12.0, ("joint.el.drive.b_m",)),),
        place=None,
        left=None,
        known=known,
        strain=Strain(0.0, 0),
        standing=standing_of(found, before.laws),
    )


TRIAL = Trial(recording="r", trajectory="0", role="fit", nominal=9.0, known=3.0, corrected=1.2, channels={})


def unseen(*given: Any) -> Told:
    """What is written but the page, which nobody looks at: drawing it takes longest."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(output, "build", lambda folder, *_: folder / "index.html")
        return write_diagnosis(*given)


@pytest.fixture(scope="module")
def written(outcome: Outcome, tmp_path_factory: pytest.TempPathFactory) -> Path:
    (find,), experiment = outcome.finds, outcome.known.experiment
    trajectory = family(limits_of(experiment.drives, experiment.dt), ("az", "el"), 60.0, "el")[0]
    proposal = Proposal(LAW, (CABLE,), trajectory, 3.0, 0.067, 3, float("nan"), (Planned(trajectory.words, 3.2),))
    target = tmp_path_factory.mktemp("diagnosis") / "out"
    campaign = load_campaign(bench.CAMPAIGN, checksums=False)
    discs = merged([disc(find, 1.0, ""), disc(find, 2.0, "_2")])
    write_corrected(campaign, replace(outcome, finds=discs), target.parent / "discs")
    off = replace(outcome, finds=(), moved=(OFF,))
    told_off = write_diagnosis(campaign, declared(experiment), off, target, False, None, "")
    nothing = "Model with its nominal parameters refitted, and nothing added"
    assert told_off.verdict_lines[1] == f"{nothing}: {target / 'corrected'}"
    assert nothing in (target / "index.html").read_text().replace("\u00a0", " ")
    command = load(target, DiagnosisResults).provenance.command
    assert command == "kbs-process campaign/EL089", "of a diagnosis at the end of processing"
    assert told_off.verdict_lines[0].startswith("Nominal parameters are off (joint.el.drive.Ka +5.0 sigma): with that")
    assert "would look the same" in told_off.verdict_lines[0] and "{" not in told_off.verdict_lines[0]
    hidden = replace(outcome, finds=(), strain=Strain(1000.0, 10))
    assert hidden.verdict == "undecided" and replace(hidden, moved=off.moved).verdict == "parameters off"
    told_hidden = unseen(campaign, declared(experiment), hidden, target, False, None, "")
    assert "together farther from what the files say" in told_hidden.verdict_lines[0]
    assert "most: " in told_hidden.verdict_lines[0] and "Check these at their source" in told_hidden.verdict_lines[0]
    cut_short = replace(off, ended=True)
    assert cut_short.verdict == "undecided" and replace(cut_short, moved=()).verdict == "none"
    told_cut = unseen(campaign, declared(experiment), cut_short, target, False, None, "")
    assert told_cut.verdict_lines[0].startswith(
        "Nominal parameters that are off (joint.el.drive.Ka +5.0 sigma) would explain all: with that"
    )
    assert "is open, as the search ended before all were tried." in told_cut.verdict_lines[0]
    more = unseen(
        campaign, declared(experiment), replace(outcome, after=Detection((), -80.0, 1.44)), target, False, proposal
    )
    assert "The model lacks: curve" in more.verdict_lines[0]
    shown = max(trial.corrected for trial in load(target, DiagnosisResults).trials)
    assert shown > 1.2, "by what the folder of the corrected model predicts"
    assert f"{shown:.3g} times the repeatability (rms) is left: more is missing, or" in more.verdict_lines[0]
    much = write_diagnosis(
        campaign, declared(experiment), replace(outcome, after=Detection((), -80.0, 2.25)), target, False, proposal
    )
    assert much.verdict_lines[0].startswith(
        "Nearest to what the model lacks, of the effects tried: curve over joint angle"
    )
    assert f"{shown:.3g} times the repeatability (rms) is left: more is missing, or" in much.verdict_lines[0]
    assert "<strong>Undecided</strong>" in (target / "index.html").read_text()
    near, far = (
        replace(find, alternatives=(Alternative(DRAG, 0.1, share * find.rho_eff, False, True),))
        for find in outcome.finds
        for share in (0.1, 0.5)
    )
    open_yet = replace(outcome, strain=Strain(1000.0, 10), finds=(near,))
    assert open_yet.verdict == "undecided"
    assert replace(open_yet, strain=outcome.strain).verdict == "physics"
    assert replace(open_yet, finds=(far,)).verdict == "physics"
    assert replace(open_yet, finds=outcome.finds).verdict == "physics", "the rival is at the same place"
    disputed = unseen(campaign, declared(experiment), open_yet, target, False, None)
    assert disputed.verdict_lines[0].startswith("Nearest to what the model lacks, of the effects tried: curve over")
    assert "joint viscous (joint torque, el) does nearly the same" in disputed.verdict_lines[0]
    named = replace(open_yet, finds=(far,), ended=True)
    strained = unseen(campaign, declared(experiment), named, target, False, None)
    assert strained.verdict_lines[0].startswith("The model lacks: curve over")
    assert "In addition, nominal parameters are together farther from what" in strained.verdict_lines[0]
    assert "In addition" not in disputed.verdict_lines[0]
    assert "ended at its limit on simulations" in (target / "results.json").read_text()
    unseen(campaign, declared(experiment), replace(outcome, ended=True), target, False, None)
    assert "ended at its limit on simulations" in (target / "results.json").read_text()
    assert campaign.topics.command is not None and "commanded one" not in (target / "results.json").read_text()
    without = replace(campaign, topics=replace(campaign.topics, angle=campaign.topics.command))
    unseen(without, declared(experiment), outcome, target, False, None)
    assert "the motion is the commanded one" in (target / "results.json").read_text()
    assert "limit on simulations" not in (target / "results.json").read_text()
    faint = replace(outcome, finds=(), after=Detection((), -80.0, 1.02))
    (little, *_) = unseen(campaign, declared(experiment), faint, target, False, None).verdict_lines
    assert (
        "all together by 2 % of its power: too little" in little
        and "Nearest is ground cable (external wrench, el), which" in little
    )
    assert "leaves 1.1 times the repeatability (rms) in fitted recordings, but: r1 predicted no better." in little
    told = write_diagnosis(campaign, declared(experiment), outcome, target, False, proposal)
    assert told.verdict_lines[0] == "The model lacks: curve over joint angle or ground cable (external wrench, el)."
    assert told.verdict_lines[1] == f"Corrected model: {target / 'corrected'}"
    assert told.verdict_lines[-1] == f"Next test: {target / 'next-test.csv'}"
    return target


def test_what_is_told_of_the_corrected_model_is_what_its_folder_predicts(written: Path, outcome: Outcome) -> None:
    known = outcome.standing.known
    shown = shown_by(written / "corrected", known)
    each = np.sqrt(shown.known.chi2 / shown.known.rows)
    assert [trial.corrected for trial in load(written, DiagnosisResults).trials] == pytest.approx(each)
    discs, channel = shown_by(written.parent / "discs", known), known.experiment.channels.index("el")
    angle = shown.values[0][:, channel]
    added = 1e-4 * np.sin(angle) + 2e-4 * np.sin(2.0 * angle)
    assert discs.values[0][:, channel] - angle == pytest.approx(added, abs=1e-9)
    assert np.all(discs.known.chi2 > shown.known.chi2)


def test_results_read_back_and_the_page_tells_them(written: Path) -> None:
    results = load(written, DiagnosisResults)
    assert results.provenance.command == "kbs-process diagnose campaign/EL089"
    (find,) = results.finds
    assert not find.named
    assert {one.unit for one in find.parameters} == {"N m"}
    curve = "from 0.4 N m (sigma 0.01) at 1.3 rad to 0.6 N m (sigma 0.01) at 1.25 rad of the joint angle"
    assert curve in results.paragraph and "law_3" not in results.paragraph
    assert find.rivals[0].name == "ground_cable"
    assert [(one.name, one.distance, one.absorbed, one.outcome) for one in results.suspects] == [
        ("curve over joint angle", 30.0, 0.1, "accepted"),
        ("joint_viscous", 29.0, None, "refused: no"),
        ("ground_cable", 28.0, None, "refused: r1 predicted no better"),
        ("joint_viscous", 12.0, 0.999, "absorbed by joint.el.drive.b_m"),
    ]
    assert results.next_test is not None
    assert results.next_test.recordings == 3
    assert results.next_test.sigma is None
    page = (written / "index.html").read_text()
    assert "<strong>Physics left out</strong>" in page
    assert "do not distinguish curve over joint angle" in page.replace("\u00a0", " ")
    for kind in ("residual", "residual_spectrum"):
        assert {path.stem for path in (written / "tables" / kind).iterdir()} == {"r0", "r1"}


def test_residuals_are_without_what_no_recording_knows_and_keep_an_angle_s_slope(
    written: Path, outcome: Outcome
) -> None:
    known = outcome.known
    experiment = known.experiment
    trial = experiment.trials[0]
    left = (trial.measured - known.shown[trial.drive].values)[trial.valid]
    t = np.arange(len(left))
    table = pq.read_table(written / "tables" / "residual" / f"{trial.name}.parquet")
    for c, name in enumerate(experiment.channels):
        told = table[f"{name}.before"].to_numpy()
        fit = np.polyfit(t, left[:, c], 1 if c < experiment.loads else 0)
        assert told == pytest.approx(left[:, c] - np.polyval(fit, t), abs=1e-9 * np.ptp(left[:, c])), name


def test_the_corrected_model_has_the_curve_in_its_plant(written: Path) -> None:
    corrected = load_campaign(written / "corrected", checksums=False)
    assert "ground_angle_law" in corrected.effects
    quantities = corrected.rig.quantities()
    assert float(quantities["joint.el.drive.ground_angle_law_3"]) == 0.5
    assert float(quantities["joint.el.drive.ground_angle_law_3"].sigma) == pytest.approx(0.01)
    assert float(quantities["joint.el.drive.ground_angle_law_high"]) == pytest.approx(1.30)
    assert float(quantities["joint.az.drive.ground_angle_law_3"]) == 0.0  # it does not act there
    for name in (
        "el.drive.Ka",
        "el.drive.ground_angle_law_3",
        "el.drive.ground_angle_law_high",
        "az.drive.ground_angle_law_3",
    ):
        assert quantities[f"joint.{name}"].source.startswith("by diagnosis of r0"), name


def test_a_sensor_s_law_that_was_found_twice_acts_twice_in_the_corrected_model(written: Path) -> None:
    laws = load_campaign(written.parent / "discs", checksums=False).sensing
    told = [{name: float(quantity) for name, quantity in law.parameters.items()} for law in laws]
    assert [(law.law, law.site) for law in laws] == [("encoder_eccentricity", "el")] * 2
    assert [(one["eccentric_order"], one["eccentric_sin"]) for one in told] == [(1.0, 1e-4), (2.0, 2e-4)]


def test_the_next_test_can_be_simulated(written: Path) -> None:
    assert read_commands(written / "next-test.csv", ("az", "el")).t[-1] == pytest.approx(60.0)


def test_laws_of_the_catalogue_that_do_the_same_are_alike_likely() -> None:
    """By odds of formulas that nature need not have; curves, and laws that are told apart, keep theirs."""
    same = Alternative(DRAG, 0.02, 2.0, True, True)
    apart = Alternative(CABLE, 0.3, 9.0, False, True)
    curve = Alternative(LAW, 0.08, 1.0, True, True)
    linear = Alternative(CABLE, 0.0, 1.0, True, False)  # was not simulated
    chance, others = _alike_likely(0.6, [same, apart, curve, linear])
    assert chance == pytest.approx(0.31)
    assert [one.probability for one in others] == pytest.approx([0.31, 0.3, 0.08, 0.0])


@pytest.mark.parametrize(("sigmas", "told"), [(NEAR, True), (-NEAR, True), (3.0, False), (MOVED + 0.1, False)])
def test_a_number_that_went_as_far_as_it_was_let_go_is_told(outcome: Outcome, sigmas: float, told: bool) -> None:
    known = outcome.known
    name = "joint.el.drive.Ka"
    k = known.names.index(name)
    value = known.parameters.value.copy()
    value[k] += sigmas * known.parameters.sigma[k]
    moved = replace(known, value=value)
    assert moved.stopped == ((name,) if told else ())
    nothing = replace(outcome, finds=(), standing=replace(outcome.standing, known=moved))
    assert (f"{name} moved as far as chance allows" in answer(nothing, (), (), FLOOR)) == told


def test_numbers_that_are_known_to_differ_from_zero_are_told_first(outcome: Outcome, written: Path) -> None:
    (find,) = load(written, DiagnosisResults).finds
    numbers = [
        Fitted(name=f"n{k}", unit="N", value=1.0, sigma=0.5, low=-1.0 if k != 4 else 0.5, high=3.0) for k in range(6)
    ]

    def told(*parameters: Fitted) -> str:
        with_numbers = msgspec.structs.replace(find, parameters=parameters, curve=None)
        return paragraph(outcome, (with_numbers,), (TRIAL,), (), FLOOR)

    assert "): n4 = 1 (0.5 to 3) N, n0 = 1 (-1 to 3) N, n1" in told(*numbers)
    assert "n3 = " not in told(*numbers) and "none of which" not in told(*numbers)
    assert "none of which is known to differ from zero" in told(*numbers[:3])


def test_the_channel_that_shows_most_of_what_is_left_is_told(outcome: Outcome) -> None:
    def trial(**channels: float) -> Trial:
        return msgspec.structs.replace(TRIAL, channels=channels)

    def told(*trials: Trial) -> str:
        return answer(replace(outcome, after=Detection((), -80.0, 1.44)), trials, (), FLOOR)

    assert told(trial(Fx=1.0, Fy=2.0), trial(Fx=2.0**0.5, Fy=0.9, el=1.0)).endswith(" Fy shows 75 % of its power.")
    assert told(trial(Fx=1.5, Fy=1.5)) == told(trial(Fx=0.9)) == told()
    assert "of its power" not in told()


def test_what_cannot_be_told_from_a_law_is_told_with_its_place(outcome: Outcome) -> None:
    az = Place(CABLE.place.port, "az")
    cord = replace(CABLE, law="cable", place=az)
    same, apart = (Alternative(cord, 0.1, rho, True, True) for rho in (2.0, 9.0))
    spline = Alternative(replace(LAW, place=az, law="curve"), 0.1, 1.0, True, True)
    here = Alternative(replace(LAW, law="harness"), 0.1, 9.0, True, True)
    (find,) = outcome.finds
    own = f"{LAW.law} ({LAW.place.port}, {LAW.place.site})".replace("_", " ")
    assert law_in_words(replace(find, alternatives=(apart, spline))) == own
    told = law_in_words(replace(find, alternatives=(same, here)))
    assert told == own.replace(" (", " or harness (") + f", or cable ({CABLE.place.port}, az)"


@pytest.mark.parametrize("share", [0.4, 1.0])
def test_a_find_is_as_sure_as_such_finds_were(outcome: Outcome, share: float) -> None:
    """Odds among laws, times the share of finds whose place was right; what is left of one is something else's."""
    (find,) = outcome.finds
    (told,) = trusted([find], share)
    assert told.probability == share * find.probability
    assert [one.probability for one in told.alternatives] == [share * one.probability for one in find.alternatives]


@pytest.mark.parametrize(
    ("fit", "unseen", "found", "moved", "verdict"),
    [
        (1.0, 1.0, True, False, "physics"),
        (1.4, 1.4, True, False, "physics"),
        (1.6, 1.0, True, False, "undecided"),
        (1.0, 1.6, True, True, "undecided"),
        (1.0, 1.6, False, False, "undecided"),
        (1.1, 1.0, False, True, "undecided"),
        (1.02, 1.0, False, True, "undecided"),
        (0.9, 0.9, False, False, "none"),  # less than the floor has, all together
    ],
)
def test_what_is_left_decides_what_is_said(
    outcome: Outcome, fit: float, unseen: float, found: bool, moved: bool, verdict: str
) -> None:
    told = replace(
        outcome,
        finds=outcome.finds if found else (),
        after=Detection((), -80.0, fit),
        held_out=(NOTHING, Detection((), -80.0, unseen)),
        moved=(OFF,) if moved else (),
    )
    assert told.verdict == verdict
    quiet = replace(told, finds=(), after=NOTHING, held_out=None)
    assert quiet.verdict == ("parameters off" if moved else "none")
