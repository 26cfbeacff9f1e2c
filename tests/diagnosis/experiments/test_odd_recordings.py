"""Recordings that are damaged, too short or of another kind: said clearly, or left out, and never taken for physics."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import archived
from diagnosis import bench
from diagnosis.experiments.test_experiment import N, made, recording
from kbs_process.campaign.config import Campaign, RecordingEntry
from kbs_process.diagnosis.acceptance.gate import gate
from kbs_process.diagnosis.acceptance.plausible import implausible
from kbs_process.diagnosis.experiments import floor
from kbs_process.diagnosis.experiments.experiment import Experiment, Recorded
from kbs_process.diagnosis.screening.gls import Background, Sums, score
from kbs_process.diagnosis.screening.localise import cells_and_ports
from kbs_process.diagnosis.screening.scene import Scene
from kbs_process.errors import ConfigError, RecordingError
from kbs_process.identification.output_error import Scalar
from kbs_process.plant.laws import CATALOGUE, SENSING
from kbs_process.plant.rigid import loads
from kbs_process.progress import SilentProgress
from kbs_process.recordings.mcap.messages.encoding import OutStream
from kbs_process.recordings.mcap.writer import write_mcap
from kbs_process.reduction.held import Alive
from kbs_process.reduction.preparing import Prepared, told_copies
from kbs_process.reduction.reading import read_run
from kbs_process.rig.model import Rig
from kbs_process.signals.records import Array, Block, Events, Loss, Mask, Run
from kbs_process.stages.motion import Motion
from kbs_process.stages.repeats import copies
from kbs_process.studies.correlate.findings import _lags
from kbs_process.studies.diagnose import reading
from kbs_process.studies.diagnose.diagnosable import LEAST_S, check_copies, check_length, check_noise, check_signs
from kbs_process.studies.diagnose.reading import LONGEST_S, busiest, passed_over, read_stretch

pytestmark = pytest.mark.slow

ENTRY = RecordingEntry("a", Path("recordings/a.mcap"), "SWING", "fit", 1, None, None, None)


def campaign() -> Campaign:
    return archived.campaign("EL089", recordings=False)


def wrench() -> Array:
    """Twenty seconds at 100 Hz, as the transducer's data sheet has it."""
    rng = np.random.default_rng(3)
    sizes = np.array([0.02] * 3 + [0.002] * 3)
    return np.asarray(sizes * np.round(2.0 * rng.standard_normal((2000, 6))), dtype=np.float64)


def passed(
    values: Array, rig: Rig | None = None, chunk: int = 37, *, keep: bool = False, apart: int = 10_000_000
) -> tuple[Array, tuple[Loss, ...]]:
    """What is left of readings that come in small pieces, and what is told of them."""
    alive, stamp = Alive(rig or bench.rig(), ENTRY, keep=keep), np.arange(len(values)) * 10_000_000 // apart * apart
    pieces = (slice(start, start + chunk) for start in range(0, len(values), chunk))
    blocks = alive(("wrench", Block(stamp[own], stamp[own], values[own])) for own in pieces)
    return np.concatenate([block.stamp for _, block in blocks]), alive.losses


def test_the_first_message_of_every_topic_is_read_whichever_was_logged_first(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    t = np.arange(0, 3_000_000_000, 10_000_000)
    cycles = t[::10]
    swing = np.zeros((len(t), 2))
    path = tmp_path / "a.mcap"
    # The command's first message is logged before that of the wrench, the encoder's after it.
    write_mcap(
        path,
        [
            OutStream("/transducer/wrench", "wrench", t, t + 500, rng.standard_normal((len(t), 6))),
            OutStream("/encoder", "joints", t, t + 900, swing, ("az", "el")),
            OutStream("/command", "joints", cycles, cycles + 100, np.tile(swing[::10], 2), ("az", "el")),
        ],
    )
    run = read_run(campaign(), replace(ENTRY, path=path))
    assert run.command is not None
    assert run.command.t[0] == pytest.approx(0.0, abs=1e-6)
    assert len(run.command.t) == len(cycles)


def test_a_channel_that_is_dead_is_told() -> None:
    values = wrench()
    values[:, 2] = 12.5
    with pytest.raises(RecordingError, match=r"a\.mcap: Fz reads 12\.5 without any noise for 100 %"):
        passed(values)


@pytest.mark.parametrize("chunk", [37, 300, 2000])
def test_stretches_in_which_a_channel_is_saturated_are_left_out_and_told(chunk: int) -> None:
    values = wrench()
    stamps, losses = passed(values, chunk=chunk)
    assert len(stamps) == 2000 and losses == ()
    values[600:740, 4] = 0.1
    values[1000:1012, 1] = 0.1  # shorter than anything that is told from chance
    stamps, (loss,) = passed(values, chunk=chunk)
    assert set(np.arange(2000)) - set(stamps // 10_000_000) == set(range(600, 740))
    assert (loss.kind, loss.where, loss.count) == ("held", "Ty", 140)
    assert (loss.start_s, loss.end_s) == pytest.approx((6.0, 7.39))


@pytest.mark.parametrize("apart", [10_000_000, 50_000_000])
def test_what_is_judged_keeps_what_was_cut_off_and_tells_of_it(apart: int) -> None:
    """Also where stamps are those of packets of five."""
    values = wrench()
    values[600:740, 4] = 50.0
    stamps, (loss,) = passed(values, keep=True, apart=apart)
    assert len(stamps) == 2000
    assert (loss.kind, loss.where) == ("held", "Ty")
    assert loss.count == pytest.approx(140, abs=2)


@pytest.mark.parametrize("chunk", [37, 2000])
def test_what_noise_does_not_repeat_is_held_however_short(chunk: int) -> None:
    """All channels are missing then, and one may be cut off; what a logger repeats all the time is not held."""
    values = np.random.default_rng(4).normal(0.0, bench.rig().transducer.noise.value, (2000, 6))
    frozen, cut = values.copy(), values.copy()
    frozen[1000:1020] = frozen[1000]
    stamps, losses = passed(frozen, chunk=chunk, keep=True)
    assert set(np.arange(2000)) - set(stamps // 10_000_000) == set(range(1000, 1020)) and losses == ()
    cut[1000:1020, 4] = 0.25
    stamps, (loss,) = passed(cut, chunk=chunk, keep=True)
    assert len(stamps) == 2000 and (loss.where, loss.count) == ("Ty", 20)
    stamps, losses = passed(values.repeat(4, axis=0), chunk=chunk, keep=True)
    assert len(stamps) == 8000 and losses == ()


def test_a_channel_whose_resolution_hides_its_noise_may_stand_still() -> None:
    fine = bench.rig().transducer
    coarse = replace(fine, resolution=replace(fine.resolution, value=np.full(6, 1.0)))
    values = wrench()
    values[:, 2] = 12.0
    assert len(passed(values, replace(bench.rig(), transducer=coarse))[0]) == 2000


def test_coarse_codes_that_stay_are_not_held_and_a_peak_that_is_cut_off_is() -> None:
    """Torques of a slow swing in steps of many times their noise, at rest at the highest one in the end."""
    values = wrench()
    sweep = 0.3 * np.sin(np.arange(2000) / 300.0) * (np.arange(2000) < 1400)
    values[:, 4] += sweep
    coarse = values.copy()
    coarse[:, 3:] = 0.1 * np.rint(values[:, 3:] / 0.1)
    for chunk in (37, 2000):
        assert [loss.where for loss in passed(coarse, chunk=chunk, keep=True)[1]] == ["Tx", "Tz"]  # nothing moves them
        assert all("throughout" in loss.detail for loss in passed(coarse, chunk=chunk, keep=True)[1])
        cut = values.copy()
        cut[:, 4] = np.minimum(values[:, 4], 0.25)
        (loss,) = passed(cut, chunk=chunk, keep=True)[1]
        assert loss.where == "Ty" and "saturated" in loss.detail and loss.count > 100


def test_slow_readings_of_a_few_codes_of_noise_are_the_same_by_chance_now_and_then() -> None:
    rng = np.random.default_rng(7)
    noise = bench.rig().transducer.noise.value
    values = np.asarray(noise / 2.6 * np.rint(2.6 * rng.standard_normal((3000, 6))))
    same = (values[2:] == values[1:-1]) & (values[1:-1] == values[:-2])
    assert same.any()  # for half a second at 5 Hz
    stamp = np.arange(3000) * 200_000_000
    for held, told in ((2, 0), (40, 1)):
        own = values.copy()
        own[1000 : 1000 + held, 2] = own[1000, 2]
        alive = Alive(bench.rig(), ENTRY, keep=True)
        list(alive([("wrench", Block(stamp, stamp, own))]))
        assert len(alive.losses) == told


def test_sensors_without_stated_noise_are_told() -> None:
    silent = replace(
        bench.rig().transducer,
        noise=replace(bench.rig().transducer.noise, value=np.zeros(6)),
        resolution=replace(bench.rig().transducer.resolution, value=np.zeros(6)),
    )
    check_noise(bench.rig(), "EL089")
    with pytest.raises(ConfigError, match="noise nor resolution of Fx, Fy, Fz, Tx, Ty, Tz"):
        check_noise(replace(bench.rig(), transducer=silent), "EL089")


def swinging() -> tuple[Run, Motion]:
    """A recording of the weight of an antenna that is raised and lowered by 11 degrees."""
    run = recording("a", 0.0).run
    assert run.wrench is not None and run.angle is not None
    q = np.stack([np.zeros(N), 1.2 + 0.2 * np.sin(0.3 * (run.wrench.t - 0.013))], axis=1)
    rest = np.zeros_like(q)
    wrench = run.wrench.derive(loads(bench.rig(), q, rest, rest)[:, :6], "weight")
    moved = Motion(0.0, bench.DT, q, rest, rest, rest, rest[None], np.zeros(2), np.zeros(2), wrench.valid)
    return replace(run, wrench=wrench, angle=run.angle.derive(q, "angle")), moved


def test_what_is_read_with_the_other_sign_is_told() -> None:
    run, moved = swinging()
    assert run.wrench is not None and run.angle is not None
    check_signs(run, moved, campaign(), ENTRY)
    reaction = replace(run, wrench=run.wrench.derive(-run.wrench.values, "reaction"))
    with pytest.raises(
        RecordingError, match=r"slope of measured [FT]. against its computed load is -1\.000 ± .*, expected \+1"
    ):
        check_signs(reaction, moved, campaign(), ENTRY)
    noise = bench.rig().loads.noise[:6]
    faint = run.wrench.derive(5.0 * noise / run.wrench.values.std(axis=0) * run.wrench.values, "faint")
    quiet = moved.q.copy()
    quiet[:, 1] = 1.2 + 1e-5 * (moved.q[:, 1] - 1.2)
    check_signs(
        replace(run, wrench=faint.derive(-faint.values, "reaction")), replace(moved, q=quiet), campaign(), ENTRY
    )
    dead = replace(run, angle=run.angle.derive(np.ones((N, 2)), "dead"))
    with pytest.raises(RecordingError, match=r"slope of encoder el against its command is \+0\.0000, expected \+1"):
        check_signs(dead, moved, campaign(), ENTRY)


def test_next_to_nothing_that_is_left_of_a_recording_is_told() -> None:
    valid = np.arange(1000) < LEAST_S / bench.DT
    check_length("a", valid, bench.DT, "a.mcap")
    with pytest.raises(RecordingError, match=r"4\.9 s of 50\.0 s can be compared"):
        check_length("a", np.roll(valid, 2) & valid, bench.DT, "a.mcap")


def slower(one: Recorded) -> Recorded:
    return replace(one, run=replace(one.run, rates={"wrench": 50.0, "angle": 100.0}))


def gappy(one: Recorded, gone: Mask) -> Recorded:
    assert one.run.wrench is not None
    wrench = one.run.wrench
    return replace(one, run=replace(one.run, wrench=wrench.derive(wrench.values, "gap", valid=wrench.valid & ~gone)))


def test_recordings_at_other_rates_are_no_repeats_for_their_noise_is_another() -> None:
    experiment = made(recording("a", 0.0), recording("b", 0.1), slower(recording("c", 0.2)))
    assert sorted(map(len, experiment.repeats)) == [1, 2]


def test_recordings_without_anything_in_common_are_no_repeats() -> None:
    first = np.arange(N) < N // 2
    experiment = made(gappy(recording("a", 0.0), first), gappy(recording("b", 0.0), ~first))
    assert sorted(map(len, experiment.repeats)) == [1, 1]


def test_recordings_that_were_driven_alike_in_no_common_part_are_no_repeats() -> None:
    a = replace(recording("a", 0.0), unknown=((-1.0, 0.5 * N * bench.DT),))
    b = replace(recording("b", 0.0), unknown=((0.5 * N * bench.DT, 1e3),))
    assert sorted(map(len, made(a, b).repeats)) == [1, 1]


def test_nothing_is_compared_where_a_measured_motion_has_a_gap() -> None:
    run, moved = swinging()
    t = bench.DT * np.arange(N)
    gone = (t > 20.0) & (t < 22.0)
    for motion, missing in ((moved, 0.0), (replace(moved, valid=moved.valid & ~gone, reach=1.5), 5.0)):
        (trial,) = made(Recorded("fit", "SWING", run, None, motion)).trials
        assert trial.valid[gone].any() != bool(missing)
        assert np.count_nonzero(~trial.valid) * bench.DT == pytest.approx(missing, abs=0.2)


def test_nothing_is_compared_after_the_last_command_of_a_motion() -> None:
    experiment = made(replace(recording("a", 0.0), known_until=30.0))
    t = bench.DT * np.arange(N)
    assert not experiment.trials[0].valid[t > 30.0].any()
    assert experiment.trials[0].valid[(t > 1.0) & (t < 29.0)].all()


def alike() -> Experiment:
    """Two repeats without noise, as nothing but a simulation makes them."""
    experiment = bench.experiment(bench.rig(), ("fit", "fit"), 1)
    first, second = experiment.trials
    return replace(experiment, trials=(first, replace(second, measured=first.measured)))


def test_repeats_that_are_the_same_have_what_the_plant_is_exact_to_for_a_floor() -> None:
    experiment = alike()
    predicted = bench.standing(experiment, (Scalar("joint.el.drive.Ka"),)).predicted[0].values
    found = floor.estimate(experiment, {k: trial.measured - predicted for k, trial in enumerate(experiment.trials)})
    whiten = found.whitener(experiment.trials[0], predicted)
    # A tenth of the stated noise is one sigma of this floor.
    noise = np.concatenate([[0.02] * 3, [0.002] * 3, [0.0] * 2]) * np.sqrt(20.0 / 100.0)
    x = 0.1 * noise * np.random.default_rng(5).standard_normal(predicted.shape)
    z = whiten(x).reshape(whiten.shape)[:, :, :6]
    assert np.mean(z**2) == pytest.approx(1.0, abs=0.3)


def test_a_recording_without_a_window_has_no_cells_and_one_with_a_gap_has_those_around_it() -> None:
    free = (Scalar("joint.el.drive.Ka"),)
    short = bench.standing(bench.experiment(bench.rig(), ("fit", "fit"), 2), free)
    cells, ports, _ = cells_and_ports(short, floor.declared(short.known.experiment), _paths(short))
    assert len(cells.z) == 0 and cells.J.shape == (0, 8, 1) and ports == ()
    experiment = bench.experiment(bench.rig(), ("fit",), 2, seconds=36.0)
    valid = experiment.trials[0].valid.copy()
    valid[350] = False
    broken = replace(experiment, trials=(replace(experiment.trials[0], valid=valid),))
    long = bench.standing(broken, free)
    cells, ports, _ = cells_and_ports(long, floor.declared(broken), _paths(long))
    assert np.unique(cells.t) == pytest.approx([0.5 + 8.0, 17.55 + 8.0])
    assert len(ports) > 10


def _paths(standing):  # type: ignore[no-untyped-def]
    return Scene.of(standing.known.experiment, standing.hypothesis, standing.predicted).paths


def test_a_law_of_a_size_that_none_has_is_refused() -> None:
    eccentric = next(law for law in SENSING if law.name == "encoder_eccentricity")
    usual = {"eccentric_sin": (3e-4, 1e-5), "eccentric_cos": (-0.5, 0.4)}
    assert implausible(eccentric, usual) == ()
    (reason,) = implausible(eccentric, usual | {"eccentric_sin": (0.87, 0.002)})
    assert reason == "eccentric_sin = 0.87 rad, and it may be -0.02 to 0.02 rad"
    assert implausible(eccentric, usual | {"eccentric_sin": (np.nan, 0.002)})
    coulomb = next(law for law in CATALOGUE if law.name == "coulomb")
    assert implausible(coulomb, {"coulomb": (90.0, 1.0)}) == ()
    assert implausible(coulomb, {"coulomb": (190.0, 1.0)})
    cord = next(law for law in CATALOGUE if law.name == "bungee")
    assert implausible(cord, {"stiffness": (-1.0, 0.5)}) == ()
    assert implausible(cord, {"stiffness": (-2.0, 0.5)})  # a cord does not push
    coarse = next(law for law in SENSING if law.name == "encoder_quantisation")
    assert implausible(coarse, {"coarse_share": (0.95, 0.02)}) == ()
    assert implausible(coarse, {"coarse_share": (0.2, 0.02)})  # what is rounded is rounded whole


def test_a_signature_of_next_to_no_length_does_nothing() -> None:
    background = Background.of({0: np.ones(50)}, {0: np.zeros((50, 0))}, np.zeros(0))
    with np.errstate(over="raise", invalid="raise"):
        found = score(background, Sums.over(background, {0: np.full((50, 2), 1e-170)}))
    assert found.rank == 0 and found.gain == 0.0


def test_a_recording_whose_commands_have_a_gap_is_left_out_until_what_was_guessed_has_rung_out() -> None:
    experiment = made(replace(recording("a", 0.0), unknown=((10.0, 20.0),)))
    t = bench.DT * np.arange(N)
    inside = (t > 10.0) & (t < 20.0)
    assert not experiment.trials[0].valid[inside].any()
    assert experiment.trials[0].valid[(t > 21.0) & (t < 29.0)].all()


def long_run() -> Run:
    """50 minutes, in which most moves from 1000 s to 1550 s."""
    dt, n = 1.0, 3000
    t = dt * np.arange(n)
    moving = (t > 1000.0) & (t < 1550.0) | (t > 2000.0) & (t < 2100.0)
    position = np.stack([np.cumsum(1e-3 * moving * np.sin(0.05 * t)), np.ones(n)], axis=1)
    run = recording("a", 0.0, n=N).run
    assert run.wrench is not None
    wrench = replace(run.wrench, dt=dt, values=np.zeros((n, 6)), valid=np.ones(n, dtype=np.bool_))
    command = Events(t, np.hstack([position, 0.0 * position]), ("az", "el", "az.rate", "el.rate"))
    return replace(run, wrench=wrench, command=command)


def test_of_a_long_recording_that_stretch_is_looked_at_in_which_most_moves_from_rest_on() -> None:
    assert busiest(recording("a", 0.0).run) is None
    span = busiest(long_run())
    assert span is not None
    assert 940.0 <= span[0] <= 1000.0
    assert span[1] == span[0] + LONGEST_S


def test_which_part_of_a_long_recording_is_looked_at_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def read(_: object, entry: RecordingEntry) -> Run:
        asked.append((entry.start, entry.end))
        return long_run()

    monkeypatch.setattr(reading, "read_alive", read)
    part = read_stretch(campaign(), replace(ENTRY, start=100.0), SilentProgress())
    (start, _), (begin, end) = asked
    assert (start, end - begin) == (100.0, LONGEST_S)
    (loss,) = part.losses
    assert loss.count == (3000 - LONGEST_S) * long_run().load_rates[0]
    (notice,) = passed_over(ENTRY, part.losses)
    assert f"of its 3000 s only those from {begin:.0f} s to {end:.0f} s" in notice.what
    assert "start_s and end_s" in notice.remedy


def test_a_copy_is_no_repeat() -> None:
    first, second = recording("a", 0.0).run, recording("b", 0.3).run
    copied = replace(ENTRY, path=Path("recordings/b.mcap"))
    check_copies([(ENTRY, first), (copied, second)])
    with pytest.raises(RecordingError, match=r"b\.mcap: it has the same readings as a\.mcap"):
        check_copies([(ENTRY, first), (copied, replace(first, name="b"))])


def test_a_copy_is_told_and_repeats_nothing() -> None:
    first, second = recording("a", 0.0).run, recording("b", 0.3).run
    runs = [first, second, replace(first, name="c")]
    assert copies(runs) == {2: 0}
    assert first.wrench is not None
    values = first.wrench.values[:-100].copy()
    values[-20:] += 1e-3  # where the recording goes on, and its part does not
    part = replace(first, wrench=replace(first.wrench, values=values, valid=first.wrench.valid[:-100]))
    assert copies([first, second, part]) == {2: 0}
    prepared = [
        Prepared(replace(ENTRY, path=Path(f"recordings/{run.name}.mcap"), name=run.name), run.loads, run, None)  # type: ignore[arg-type]
        for run in runs
    ]
    told = told_copies(prepared)
    (loss,) = told[2].run.losses
    assert (loss.kind, loss.where, loss.real) == ("copy", "c", True)
    assert loss.detail == "the same readings as a: no repeat"
    assert [one.run.losses for one in told[:2]] == [(), ()]
    assert list(_lags(told)) == [0, 1]  # type: ignore[arg-type]


def test_a_law_whose_coefficients_have_no_covariance_does_not_pass() -> None:
    known = bench.standing(bench.experiment(bench.rig(), ("fit", "held-out"), 4), (Scalar("joint.el.drive.Ka"),)).known
    for covariance in (np.zeros((1, 1)), np.full((1, 1), np.nan)):
        verdict = gate(known, replace(known, covariance=covariance), [0])
        assert not verdict.passed
        assert "its coefficients are not determined" in verdict.reasons
