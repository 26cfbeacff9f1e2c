"""The first half of processing, which `validate` goes through as well: recordings read, gravity fitted to them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from kbs_process.campaign.config import Campaign, RecordingEntry
from kbs_process.errors import RecordingError
from kbs_process.progress import Progress
from kbs_process.reduction.held import noisy, read_alive
from kbs_process.reduction.losses import foremost
from kbs_process.reduction.relief import forces_in, relieved, without_effects
from kbs_process.reduction.settings import gravity_settings, motion_settings
from kbs_process.results.kept import kept
from kbs_process.results.provenance import sha256
from kbs_process.signals.records import COPY, Loss, Run, Signal
from kbs_process.stages import decouple, motion
from kbs_process.stages.align.prints import Printed, Prints
from kbs_process.stages.align.readings import Readings, Watch
from kbs_process.stages.decouple import Decoupling
from kbs_process.stages.gravity import model as gravity
from kbs_process.stages.gravity.model import GravityModel, Sample
from kbs_process.stages.gravity.taring import Taring
from kbs_process.stages.motion import Motion
from kbs_process.stages.repeats import copies


@dataclass(frozen=True, slots=True, eq=False)
class Prepared:
    """A recording on one clock, decoupled, with its joints' motion."""

    entry: RecordingEntry
    raw: Signal
    run: Run
    motion: Motion
    readings: Mapping[str, Readings] = field(default_factory=dict)  # by stream
    prints: Sequence[Prints] = ()  # of the wrench, by recorded channel


def prepare(
    campaign: Campaign, entry: RecordingEntry, decoupling: Decoupling, progress: Progress, *, keep_spikes: bool = False
) -> Prepared:
    """Read a recording as processing needs it; `keep_spikes`: with its single bad samples."""
    with progress.task(f"Reading {entry.name}"):
        run, readings, prints = _read(campaign, entry, keep_spikes)
        if run.loads is None:
            raise RecordingError("there is neither wrench nor effort in this recording", where=str(entry.path))
        return Prepared(
            entry,
            run.loads,
            decouple.apply(run, decoupling),
            motion.estimate(run, campaign.rig, motion_settings(campaign)),
            readings,
            prints,
        )


def _read(
    campaign: Campaign, entry: RecordingEntry, keep_spikes: bool
) -> tuple[Run, Mapping[str, Readings], Sequence[Prints]]:
    """Read a recording through, unless that was done before."""

    def read() -> tuple[Run, Mapping[str, Readings], Sequence[Prints]]:
        watch, printed = Watch(), Printed()
        run = read_alive(
            campaign, entry, keep=True, keep_spikes=keep_spikes, watch=lambda blocks: printed(watch(blocks))
        )
        return run, watch.streams, printed.channels

    file = entry.path, sha256(entry.path), entry.name, entry.start, entry.end
    of_channels = campaign.rig.transducer.channels, noisy(campaign.rig)
    return kept("reading", (file, campaign.topics, campaign.bands.working_rate, *of_channels, keep_spikes), read)


def told_copies(prepared: Sequence[Prepared]) -> list[Prepared]:
    """Return recordings, with a loss in those that have the same readings as another before them: none repeats it."""
    found = list(prepared)
    for place, first in copies([one.run for one in prepared]).items():
        one = prepared[place]
        loss = Loss(COPY, one.entry.name, 0, detail=f"the same readings as {prepared[first].entry.name}: no repeat")
        found[place] = replace(one, run=replace(one.run, losses=(*one.run.losses, loss)))
    return found


def fit_gravity(campaign: Campaign, prepared: Sequence[Prepared], progress: Progress) -> GravityModel:
    """Fit over calibration and fit recordings; held-out ones are not looked at.

    Nor are those in which the rig pulled at the article, where there are others: what is not known of the pull would be
    taken for weight.
    A rig that is driven by its motion has its inertia fitted too; its commands, if any, drive nothing.
    """
    with progress.task("Fitting gravity and centres of gravity"):
        moving, settings = campaign.drive == "motion", gravity_settings(campaign)
        fitted = samples(campaign, prepared)
        return kept(
            "gravity",
            (fitted, campaign.rig, moving, settings),
            lambda: gravity.fit(fitted, campaign.rig, include_inertia=moving, settings=settings),
        )


def samples(campaign: Campaign, prepared: Sequence[Prepared]) -> list[Sample]:
    """Return what gravity is fitted to; see `fit_gravity`."""
    fitted = [one for one in prepared if one.entry.role != "held-out"]
    free = [one for one in fitted if not forces_in(campaign, one.entry)]
    return [
        Sample(
            one.entry.name,
            one.motion,
            without_effects(campaign, one.entry, one.motion, loads, campaign.rig),
            calibration=one.entry.role == "calibration",
            lost=foremost(one.run.losses),
            gaps=one.run.gaps,
            reach=one.run.reach,
        )
        for one in free or fitted
        if (loads := relieved(campaign, one.entry, one.run, one.motion).loads) is not None
    ]


def tare(
    campaign: Campaign, entry: RecordingEntry, run: Run, motion: Motion, model: GravityModel
) -> tuple[Sample, Taring]:
    """Return what gravity is taken off of a recording whose cords are relieved, and its zeros.

    Raises RecordingError where too little of it is whole for that.
    """
    assert run.loads is not None  # `prepare` demands them
    loads = without_effects(campaign, entry, motion, run.loads, model.rig)
    sample = Sample(entry.name, motion, loads, lost=foremost(run.losses), gaps=run.gaps, reach=run.reach)
    return sample, gravity.tare(sample, model)


def check_taring(campaign: Campaign, one: Prepared, model: GravityModel) -> None:
    """Raise RecordingError where processing could not take gravity off a recording, in the fit or not."""
    tare(campaign, one.entry, relieved(campaign, one.entry, one.run, one.motion), one.motion, model)
