"""Do the gravity fit's sigmas hold the truth as often as they say? Run from tests/:

    python -m stages.gravity.drawn_rigs --first 7000 --count 12 [--still]

Each seed draws hardware from the priors of an archived campaign, in turn EL089, AESING00, ACQ600, AESTPP00, ELSTPP00
and AZPS_ATA (so seed 7000 is ELSTPP00), and records it three times by the independent engine: calibration, a run that
is fitted with it, and one held out. Printed are, for all parameters, for those that the recordings inform, and for each
group of these, the rms of (fitted - true) / sigma and the part within 2 sigma with its 95 % binomial interval; then the
error of the held-out recordings' static wrench next to the stated one. Hardware is cut at two prior sigmas, so that z
of what the recordings do not inform has an rms of 0.88. `--still` leaves the drives' dynamics out: 1 s of processor a
campaign instead of 30 s, and 6 s for its fit.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import beta

from kbs_process.signals.records import WRENCH_CHANNELS, Array, Signal
from kbs_process.stages import bandpass, budget, motion
from kbs_process.stages.bandpass import Band
from kbs_process.stages.gravity import error as gravity_error
from kbs_process.stages.gravity import model as gravity
from stages.gravity.drawn import CALIBRATION, Drawn, DrawnCampaign, truth_of

KINDS = (
    ("EL089", "EL089P00"),
    ("AESING00", "AESING00"),
    ("ACQ600", "ACQ600"),
    ("AESTPP00", "AESTPP00"),
    ("ELSTPP00", "ELSTPP00"),
    ("AZPS_ATA", CALIBRATION),
)
INFORMED, WELL_INFORMED = 1.5, 3.0  # prior sigma over sigma
GROUPS = ("mass", "cog", "tilt", "misalignment", "offset", "origin", "stiffness", "cross_coupling")
BAND = Band("lt1Hz", 0.01, 1.0)


@dataclass(frozen=True)
class Scores:
    """One campaign: every fitted parameter, and the held-out recording's static wrench."""

    names: tuple[str, ...]
    z: Array  # (p,) (fitted - true) / sigma
    gain: Array  # (p,) prior sigma / sigma
    constant: Array  # (6,) mean of the held-out static wrench: error over sigma
    wrong: Array  # (6,) the same in the band: rms error, N and N m
    stated: Array  # (6,) what the budget's entries for gravity state for it


def make(seed: int, *, still: bool) -> tuple[DrawnCampaign, list[Drawn]]:
    """Draw a campaign and record it: calibration, fitted run, held-out run."""
    name, trajectory = KINDS[seed % len(KINDS)]
    campaign = DrawnCampaign(name, seed)
    return campaign, [
        campaign.record(trajectory, index, still=still)
        for index, trajectory in enumerate((CALIBRATION, trajectory, trajectory))
    ]


def score(campaign: DrawnCampaign, recordings: Sequence[Drawn]) -> Scores:
    """Fit the first two recordings, subtract the static wrench from the third."""
    samples = [
        gravity.Sample(
            drawn.run.name, motion.estimate(drawn.run, campaign.rig), drawn.run.wrench, calibration=index == 0
        )
        for index, drawn in enumerate(recordings)
    ]
    settings = gravity.GravitySettings(taring_Hz=2.0)
    model = gravity.fit(samples[:2], campaign.rig, include_inertia=False, settings=settings)
    size = model.equation.size
    truth = np.array([campaign.parameter(name) for name in model.equation.names])
    constant, wrong, stated = _held_out(campaign, recordings[2], samples[2], model)
    return Scores(
        names=model.equation.names,
        z=(model.fit.value[:size] - truth) / model.fit.sigma[:size],
        gain=model.equation.sigma() / model.fit.sigma[:size],
        constant=constant,
        wrong=wrong,
        stated=stated,
    )


def _held_out(
    campaign: DrawnCampaign, drawn: Drawn, sample: gravity.Sample, model: gravity.GravityModel
) -> tuple[Array, Array, Array]:
    taring = gravity.tare(sample, model)
    static = gravity.apply(sample.motion, model, taring)
    wrong = static.wrench.derive(static.wrench.values - truth_of(campaign, drawn), "error")
    slopes = gravity_error.Slopes.of(sample.motion, model)
    stated = budget.total(gravity_error.entries(sample.motion, static, model, slopes, _cut))
    mean = wrong.values[wrong.valid].mean(axis=0)
    return mean / taring.noise, budget.rms(_cut(wrong)), stated


def _cut(signal: Signal) -> Signal:
    return bandpass.apply(signal, BAND)


def lines(scores: Iterable[Scores]) -> Iterator[str]:
    """Figures of many campaigns."""
    scores = list(scores)
    z, gain = (np.concatenate([getattr(one, key) for one in scores]) for key in ("z", "gain"))
    group = np.array([next(g for g in GROUPS if g in name) for one in scores for name in one.names])
    yield _line("all", z)
    yield _line(f"gain > {INFORMED:g}", z[gain > INFORMED])
    yield _line(f"gain > {WELL_INFORMED:g}", z[gain > WELL_INFORMED])
    for name in GROUPS:
        yield _line(name, z[group == name])
        if np.any(chosen := (group == name) & (gain > INFORMED)):
            yield _line(f"{name}, informed", z[chosen])
    yield _line("held-out constant", np.concatenate([one.constant for one in scores]))
    yield "held-out static wrench, 0.01 to 1 Hz, rms of all campaigns, mN and mN m:"
    for index, channel in enumerate(WRENCH_CHANNELS):
        wrong, stated = (
            1e3 * np.sqrt(np.mean([getattr(one, key)[index] ** 2 for one in scores])) for key in ("wrong", "stated")
        )
        yield f"    {channel}: error {wrong:.4f}, stated {stated:.4f}, ratio {wrong / stated:.2f}"


def _line(name: str, z: Array) -> str:
    n, inside = len(z), int(np.sum(np.abs(z) < 2.0))
    low, high = beta.ppf(0.025, inside, n - inside + 1), beta.ppf(0.975, inside + 1, n - inside)
    return (
        f"{name:26s} {n:5d}: z rms {np.sqrt(np.mean(z**2)):.2f}, within 2 sigma {inside / n:.3f} "
        f"[{0.0 if inside == 0 else low:.3f}, {1.0 if inside == n else high:.3f}]"
    )


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(prog="python -m stages.gravity.drawn_rigs", description=__doc__)
    parser.add_argument("--first", type=int, required=True)
    parser.add_argument("--count", type=int, default=12)
    parser.add_argument("--still", action="store_true")
    arguments = parser.parse_args()
    scores = []
    for seed in range(arguments.first, arguments.first + arguments.count):
        scores.append(score(*make(seed, still=arguments.still)))
        informed = scores[-1].z[scores[-1].gain > INFORMED]
        print(f"{seed} {KINDS[seed % len(KINDS)][0]}: z rms {np.sqrt(np.mean(informed**2)):.2f} of {len(informed)}")
    print(*lines(scores), sep="\n")


if __name__ == "__main__":
    main()
