"""What a model leaves of the recordings, as each requirement counts it: does it matter?"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from kbs_process.campaign.config import Campaign, Requirement
from kbs_process.diagnosis.experiments.experiment import Experiment
from kbs_process.errors import ConfigError
from kbs_process.reduction.analysis import bands_of, select
from kbs_process.reduction.judging import band_of
from kbs_process.reduction.measurable import judged_channels
from kbs_process.signals.records import WRENCH_CHANNELS, Array, Mask, Signal
from kbs_process.stages import bandpass
from kbs_process.stages.to_cog import to_spacecraft
from kbs_process.stages.verdict import Extreme, extremes
from kbs_process.studies.diagnose import results as records


def unexplained(
    campaign: Campaign, experiment: Experiment, known: Sequence[Array], corrected: Sequence[Array]
) -> Iterator[records.Unexplained]:
    """Each requirement's statistic of what is left, noise included, at its worst channel and recording.

    `known` and `corrected` are what two models predict of each trial, (n, c).
    Calibrations are judged by none. Of a requirement on what was not recorded nothing is said.
    """
    for requirement in campaign.requirements:
        try:
            channels = judged_channels(requirement, campaign.rig)
        except ConfigError:
            continue
        worst, before = (_worst(campaign, experiment, requirement, channels, one) for one in (corrected, known))
        if worst is not None and before is not None:
            yield records.Unexplained(
                name=requirement.name,
                statistic=requirement.statistic,
                band_Hz=requirement.band,
                limit=requirement.limit,
                unit=requirement.unit,
                known=before.value,
                corrected=worst.value,
                channel=worst.channel,
                recording=worst.recording,
            )


def _worst(
    campaign: Campaign,
    experiment: Experiment,
    requirement: Requirement,
    channels: Sequence[str],
    predicted: Sequence[Array],
) -> Extreme | None:
    """The greatest statistic of measured less predicted; None where no sample of the band is known."""
    band = band_of(requirement, bands_of(campaign.bands))
    left = []
    for k, trial in enumerate(experiment.trials):
        if trial.role == "calibration":
            continue
        signal = Signal(
            t0=0.0,
            dt=experiment.dt,
            values=_level((trial.measured - predicted[k])[:, : experiment.loads], trial.valid),
            channels=experiment.channels[: experiment.loads],
            units=experiment.units[: experiment.loads],
            frame=campaign.rig.frame,
            valid=trial.valid,
        )
        cut = bandpass.apply(signal, band)
        if requirement.frame != signal.frame:
            assert campaign.rig.spacecraft is not None  # it has channels there
            cut = to_spacecraft(select(cut, WRENCH_CHANNELS), campaign.rig.spacecraft)
        left.append((trial.name, cut))
    return max(extremes(left, channels, requirement.statistic), key=lambda one: one.value, default=None)


def _level(values: Array, valid: Mask) -> Array:
    """Without the constant and the slope that the transducer may have; zero where nothing was recorded."""
    t = np.linspace(-1.0, 1.0, len(values))
    A = np.stack([np.ones_like(t), t], axis=1)
    level: Array = values - A @ np.linalg.lstsq(A[valid], values[valid], rcond=None)[0]
    level[~valid] = 0.0
    return level
