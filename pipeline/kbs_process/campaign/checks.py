"""What no format can say: that the parts of a campaign agree with each other and with the disk."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from math import isclose
from pathlib import Path

from kbs_process.campaign.config import Campaign, RecordingEntry
from kbs_process.campaign.documents import Document, Key, Merged, shown
from kbs_process.campaign.formats.campaign_file import CampaignFile, EncoderTable
from kbs_process.campaign.problems import Problems
from kbs_process.errors import did_you_mean
from kbs_process.files import regular
from kbs_process.plant.effect import Effect, Port
from kbs_process.plant.laws import CATALOGUE, MEASURED, catalogue_with, find
from kbs_process.results.provenance import sha256
from kbs_process.rig.model import LAB, Joint, Quantity

_KEPT = 0.4  # of the working rate: decimation changes nothing below (stages.resample)
_SLOWEST, _FASTEST = 2e-4, 0.25  # of the working rate: high-passes that can be computed (stages.lowfrequency)
_MOST_WORKING = 100.0  # times the greatest edge: beyond it, samples tell nothing and only cost
_DERIVED = 8.0  # times the widest band: angles are differentiated up to twice that, by filters that need as much again


def check_campaign(
    campaign: Campaign, file: CampaignFile, document: Document, tables: Merged, problems: Problems, *, checksums: bool
) -> None:
    """Note everything in which the campaign contradicts itself or the files on disk."""
    checks = _Checks(campaign, file, document, tables, problems)
    checks.effects()
    checks.drive()
    checks.loads()
    checks.external()
    checks.instruments()
    checks.fields()
    checks.encoders()
    checks.bands()
    checks.requirements()
    checks.recordings()
    if checksums and not problems.found:
        checks.checksums()


@dataclass(frozen=True, slots=True)
class _Checks:
    """One method for each part of a campaign; what is wrong is noted in `problems`."""

    campaign: Campaign
    file: CampaignFile
    document: Document  # campaign.toml
    tables: Merged  # parameter files
    problems: Problems

    def _note(self, key: Key, what: str, remedy: str) -> None:
        """Note what is wrong at a key of campaign.toml."""
        self.problems.add(self.document.place(key), what, remedy)

    def _note_rig(self, key: Key, what: str, remedy: str) -> None:
        """Note what is wrong at a key of the parameter files."""
        self.problems.add(self.tables.place(key), what, remedy)

    def effects(self) -> None:
        known = {effect.name for effect in (*CATALOGUE, *MEASURED)}
        for index, name in enumerate(self.file.effects):
            found, key = find(name), ("model", "effects", index)
            if found is None:
                self._note(key, f"there is no effect '{name}'", did_you_mean(name, known))
            elif found.crossed and len(self.campaign.rig.joints) < 2:
                self._note(key, f"'{name}' depends on another joint, and there is one alone", "leave it out")

    def instruments(self) -> None:
        """What an accelerometer or gyro reads says something only of a place."""
        for topic in (self.campaign.topics.accelerometer, self.campaign.topics.gyro):
            if topic is not None and topic.key not in self.campaign.rig.instruments:
                what = f"nothing says where the {topic.key} is"
                self._note(("topics", topic.key), what, f"describe [{topic.key}] in a parameter file")

    def drive(self) -> None:
        """Commands drive a controller and a drive on every joint; a motion is measured angles or rates."""
        topics, rig = self.campaign.topics, self.campaign.rig
        key = ("drive",)
        if self.campaign.drive == "motion":
            if topics.angle is None and topics.rate is None:
                remedy = "name the topic of the encoders or of the rates under [topics]"
                self._note(key, '"motion" needs measured angles or rates', remedy)
            return
        if topics.command is None:
            self._note(key, '"command" needs commands', 'name their topic under [topics], or set drive = "motion"')
        if topics.angle is None:
            self._note(key, '"command" needs encoder angles to compare with', "name their topic under [topics]")
        elif topics.command is not None and topics.angle.topic == topics.command.topic:
            remedy = 'name the topic of what the encoders measure, or set drive = "motion"'
            self._note(("topics", "encoder"), "is the commands' topic: nothing is measured", remedy)
        if not self.campaign.effects:
            remedy = "name the effects of the nominal model under [model]"
            self._note(key, '"command" needs a model of the drives', remedy)
        if rig.controller is None:
            self._note_rig(("controller",), "is missing", 'describe it, or set drive = "motion"')
        for joint in rig.joints:
            self._driven(joint)

    def _driven(self, joint: Joint) -> None:
        key: Key = ("joint", joint.name, "drive")
        if joint.drive is None:
            self._note_rig(key, "is missing", 'describe the drive, or set drive = "motion"')
            return
        if not float(joint.drive.rotor_inertia):
            what = "0.0 is out of bounds: a drive that commands turn has a rotor of its own"
            self._note_rig((*key, "rotor_inertia", "value"), what, "give more than 0")
        for effect in catalogue_with(self.campaign.effects):
            if effect.port.of_drive:
                named = effect.name in self.campaign.effects
                self._parameters(effect, joint.drive.parameters, named, (*key, "parameters"))

    def loads(self) -> None:
        """What is recorded is described, what is described is recorded, and there is something to compare with."""
        topics, rig = self.campaign.topics, self.campaign.rig
        if topics.wrench is None and rig.transducer.channels:
            self._note(("topics", "wrench"), "is missing", "name it, or leave [transducer] out")
        if topics.wrench is not None and not rig.transducer.channels:
            self._note_rig(("transducer",), "is missing", "describe it, or leave topics.wrench out")
        driven = [joint.name for joint in rig.joints if joint.effort is not None]
        if topics.effort is None and driven:
            self._note(("topics", "effort"), "is missing", f"name it, or leave joint.{driven[0]}.effort out")
        if topics.effort is not None and not driven:
            key = ("joint", rig.joint_names[0], "effort")
            self._note_rig(key, "is missing", "describe the joint's effort, or leave topics.effort out")
        if not rig.channels:
            remedy = "name the wrench of a transducer, or the effort of a joint"
            self._note(("topics",), "holds no load to compare a prediction with", remedy)
        for joint in rig.joints if self.campaign.drive == "command" else ():
            for name, special in (
                ("type", joint.type != "revolute"),
                ("viscous", joint.viscous is not None),
                ("effort", joint.effort is not None),
            ):
                if special:
                    what = "goes with a rig that its measured motion drives; the model of a drive turns its joint"
                    self._note_rig(("joint", joint.name, name), what, 'leave it out, or set drive = "motion"')

    def external(self) -> None:
        """Every effect of the laboratory in the model is described, and acts on what hangs on the transducer."""
        described = {external.name: external for external in self.campaign.rig.external}
        for effect in catalogue_with(self.campaign.effects):
            key: Key = ("external", effect.name)
            external, named = described.get(effect.name), effect.name in self.campaign.effects
            if effect.port.of_drive or (external is None and not named):
                continue
            if external is None:
                remedy = "say in a parameter file where it acts and how large it is, or leave the effect out"
                self._note_rig(key, f"is missing, although the model contains '{effect.name}'", remedy)
                continue
            if effect.port is Port.EXTERNAL_FORCE:
                if external.on == LAB:
                    what = "'lab' does not hang on the transducer: nothing would feel the force"
                    self._note_rig((*key, "on"), what, "name the link that it pulls at")
                if external.point is None:
                    remedy = "give the place where it pulls, (x, y, z) in the link's axes"
                    self._note_rig((*key, "point"), "is missing", remedy)
            if effect.port is Port.BASE_TORQUE and named and self.campaign.rig.transducer.stiffness is None:
                what = f"is missing, and '{effect.name}' acts on the angles of a plate that turns"
                remedy = "give the transducer's stiffness, or leave the effect out"
                self._note_rig(("transducer", "stiffness"), what, remedy)
            self._parameters(effect, external.parameters, named, (*key, "parameters"))

    def _parameters(self, effect: Effect, given: Mapping[str, Quantity], named: bool, key: Key) -> None:
        for parameter in effect.parameters:
            quantity = given.get(parameter.name)
            if quantity is None and named:
                remedy = f"give it ({parameter.description}, {parameter.unit}), or leave the effect out"
                what = f"is missing, although the model contains '{effect.name}'"
                self._note_rig((*key, parameter.name), what, remedy)
            low, high = parameter.bounds
            if quantity is not None and not low <= float(quantity) <= high:
                what = f"{float(quantity):g} {parameter.unit} is out of bounds"
                self._note_rig((*key, parameter.name), what, f"give {low:g} to {high:g} {parameter.unit}")

    def fields(self) -> None:
        for topic in self.campaign.topics.present():
            if len(topic.fields) != len(topic.channels):
                self._note(
                    ("topics", "encoder" if topic.key == "angle" else topic.key, "fields"),
                    f"lists {len(topic.fields)} fields for {len(topic.channels)} channels",
                    f"give one for each of {', '.join(topic.channels)}",
                )

    def encoders(self) -> None:
        """Joints that encoders read are the rig's; of the others commands say, or measured rates, how they move."""
        encoder = self.file.topics.encoder
        if not isinstance(encoder, EncoderTable) or encoder.joints is None:
            return
        names = self.campaign.rig.joint_names
        for index, name in enumerate(encoder.joints):
            if name not in names:
                key = ("topics", "encoder", "joints", index)
                self._note(key, f"there is no joint '{name}'", did_you_mean(name, names))
        unread = [name for name in names if name not in encoder.joints]
        if unread and self.campaign.drive == "motion" and self.campaign.topics.rate is None:
            what = f"leaves out {', '.join(unread)}, of which no rate is measured either"
            remedy = 'read every joint, name the topic of their rates under [topics], or set drive = "command"'
            self._note(("topics", "encoder", "joints"), what, remedy)

    def bands(self) -> None:
        bands = self.campaign.bands
        key, widest = ("bands", "low_pass_Hz"), bands.low_pass[-1]
        for lower, upper in pairwise(bands.low_pass):
            if f"{lower:g}" == f"{upper:g}":
                what = f"{lower} Hz and {upper} Hz differ too little: both bands would be called lt{lower:g}Hz"
                self._note(key, what, "keep one of them")
        if bands.working_rate > _MOST_WORKING * widest:
            what = f"{bands.working_rate:g} Hz is more than {_MOST_WORKING:g} times the greatest edge, {widest:g} Hz"
            self._note(("bands", "working_rate_Hz"), what, "lower it (10 times the greatest edge is plenty)")
        least, most = _SLOWEST * bands.working_rate, _FASTEST * bands.working_rate
        if bands.high_pass and not least <= bands.high_pass <= most:
            what = f"{bands.high_pass:g} Hz cannot be cut at the working rate, only {least:g} to {most:g} Hz"
            self._note(("bands", "high_pass_Hz"), what, "give 0 for no high-pass, or another working rate")
        if bands.low_pass[0] <= bands.high_pass:
            what = f"{bands.low_pass[0]:g} Hz is not above the high-pass, {bands.high_pass:g} Hz"
            self._note(key, what, "give greater edges, or lower high_pass_Hz")
        if widest > _KEPT * bands.working_rate:
            kept = f"{_KEPT * bands.working_rate:g} Hz"
            what = f"{widest:g} Hz is above {kept}, up to which the working rate keeps everything"
            self._note(key, what, "raise working_rate_Hz (10 times the greatest edge is plenty)")
        elif self.campaign.drive == "motion" and bands.working_rate < _DERIVED * widest:
            what = f"{widest:g} Hz is too near to the working rate for accelerations from measured motion"
            self._note(key, what, f"raise working_rate_Hz to {_DERIVED * widest:g} or more")

    def requirements(self) -> None:
        bands = self.campaign.bands
        for index, requirement in enumerate(self.campaign.requirements):
            low, high = requirement.band
            key = ("requirement", index, "band_Hz")
            if not low < high:
                self._note(key, f"[{low:g}, {high:g}] is empty", "give the lower edge first")
            elif low < bands.high_pass or high > bands.low_pass[-1]:
                wide = f"{bands.high_pass:g} to {bands.low_pass[-1]:g} Hz"
                self._note(key, f"reaches beyond the [bands], {wide}", "widen the bands, or narrow this one")
            elif not isclose(low, bands.high_pass) or not any(isclose(high, edge) for edge in bands.low_pass):
                cut = " and ".join(f"{bands.high_pass:g} to {edge:g} Hz" for edge in bands.low_pass)
                what = f"[{low:g}, {high:g}] is not cut, only {cut}: what is judged would not be what is stated"
                self._note(key, what, "state one of these bands, or change high_pass_Hz or low_pass_Hz")
            if requirement.frame == "S" and self.campaign.rig.spacecraft is None:
                what = '"S" needs to know where the spacecraft\'s centre of mass is'
                remedy = 'describe [spacecraft] in a parameter file, or use frame = "T"'
                self._note(("requirement", index, "frame"), what, remedy)

    def recordings(self) -> None:
        names: set[str] = set()
        runs: dict[tuple[str, int], str] = {}
        for index, entry in enumerate(self.campaign.recordings):
            self._recording(index, entry)
            run = entry.trajectory, entry.repeat
            if entry.name in names:
                what = f"a recording before it is called '{entry.name}' too, and results are named by it"
                self._note(("recording", index, "file"), what, "rename one of the files, or list it once")
            if runs.get(run, entry.name) != entry.name:
                what = f"run {entry.repeat} of {entry.trajectory} is '{runs[run]}' already"
                self._note(("recording", index, "repeat"), what, "number the repeats 1, 2, 3")
            names.add(entry.name)
            runs.setdefault(run, entry.name)

    def _recording(self, index: int, entry: RecordingEntry) -> None:
        key: Key = ("recording", index)
        effects = self.file.effects
        for position, name in enumerate(entry.without):
            if name not in effects:
                remedy = did_you_mean(name, effects) if effects else "leave it out"
                self._note((*key, "without", position), f"the model has no '{name}'", remedy)
        try:
            regular(entry.path)
        except (FileNotFoundError, NotADirectoryError):
            what = f"the recording '{shown(entry.path)}' does not exist"
            remedy = "" if self.problems.enough else _neighbour(entry.path, self.campaign.recordings)
            self._note((*key, "file"), what, remedy)
        except (OSError, ValueError) as error:
            reason = error.strerror if isinstance(error, OSError) else error  # a name with a NUL in it
            self._note((*key, "file"), f"the recording cannot be read: {reason}", "give the name of an MCAP file")
        if entry.start is not None and entry.end is not None and entry.end <= entry.start:
            what = f"{entry.end:g} is not after start_s, {entry.start:g}"
            self._note((*key, "end_s"), what, "give a later end")

    def checksums(self) -> None:
        for index, entry in enumerate(self.campaign.recordings):
            if entry.sha256 is not None and (found := sha256(entry.path)) != entry.sha256:
                what = f"'{shown(entry.path)}' has the SHA-256 {found}, not {entry.sha256} as stated"
                remedy = "fetch the recording again, or, if it is the right one, state its checksum here"
                self._note(("recording", index, "sha256"), what, remedy)


def _neighbour(missing: Path, recordings: Iterable[RecordingEntry]) -> str:
    """Return a remedy for a file that is missing: one in its folder with a like name, not taken; or where to put it."""
    if not missing.parent.is_dir():
        return f"the folder '{shown(missing.parent)}' does not exist either: put the recordings there"
    others = [path for path in missing.parent.iterdir() if path.is_file()]
    taken = {entry.path.resolve() for entry in recordings}
    listed = [path.name for path in others if path.resolve() in taken]
    names = [path.name for path in others]
    return did_you_mean(missing.name, names, listed) if names else "its folder is empty: put the recordings there"
