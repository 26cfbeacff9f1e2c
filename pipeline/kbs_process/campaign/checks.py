"""What no schema can check: that the parts of a campaign agree with each other and with the disk."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from math import isclose
from pathlib import Path

from kbs_process.campaign.config import Campaign, RecordingEntry
from kbs_process.campaign.documents import Document, Key, Merged, shown
from kbs_process.campaign.problems import Problems
from kbs_process.errors import did_you_mean
from kbs_process.plant.effect import Effect, Port
from kbs_process.plant.laws import CATALOGUE, MEASURED, catalogue_with, find
from kbs_process.results.provenance import sha256
from kbs_process.rig.model import LAB, Joint, Quantity

_KEPT = 0.4  # of the working rate: decimation changes nothing below (stages.resample)
_DERIVED = 8.0  # times the widest band: angles are differentiated up to twice that, by filters that need as much again


def check_campaign(
    campaign: Campaign, document: Document, tables: Merged, problems: Problems, *, checksums: bool
) -> None:
    """Note everything in which the campaign contradicts itself or the files on disk."""
    _check_effects(campaign, document, problems)
    _check_drive(campaign, document, tables, problems)
    _check_loads(campaign, document, tables, problems)
    _check_external(campaign, tables, problems)
    _check_topics(campaign, document, problems)
    _check_read(campaign, document, problems)
    _check_bands(campaign, document, problems)
    for index, entry in enumerate(campaign.recordings):
        _check_recording(campaign, index, entry, document, problems)
    if checksums and not problems.found:
        for index, entry in enumerate(campaign.recordings):
            _check_checksum(index, entry, document, problems)


def _check_effects(campaign: Campaign, document: Document, problems: Problems) -> None:
    known = {effect.name for effect in (*CATALOGUE, *MEASURED)}
    for index, name in enumerate(document.tree.get("model", {}).get("effects", [])):
        found = find(name)
        if found is None:
            place = document.place(("model", "effects", index))
            problems.add(place, f"there is no effect '{name}'", did_you_mean(name, known))
        elif found.crossed and len(campaign.rig.joints) < 2:
            place = document.place(("model", "effects", index))
            problems.add(place, f"'{name}' depends on another joint, and there is one alone", "leave it out")


def _check_drive(campaign: Campaign, document: Document, tables: Merged, problems: Problems) -> None:
    """Commands drive a controller and a drive on every joint; a motion is measured angles or rates."""
    topics, rig = campaign.topics, campaign.rig
    place = document.place(("drive",))
    if campaign.drive == "motion":
        if topics.angle is None and topics.rate is None:
            remedy = "name the topic of the encoders or of the rates under [topics]"
            problems.add(place, '"motion" needs measured angles or rates', remedy)
        return
    if topics.command is None:
        problems.add(place, '"command" needs commands', 'name their topic under [topics], or set drive = "motion"')
    if topics.angle is None:
        problems.add(place, '"command" needs encoder angles to compare with', "name their topic under [topics]")
    elif topics.command is not None and topics.angle.topic == topics.command.topic:
        remedy = 'name the topic of what the encoders measure, or set drive = "motion"'
        problems.add(document.place(("topics", "encoder")), "is the commands' topic: nothing is measured", remedy)
    if not campaign.effects:
        remedy = "name the effects of the nominal model under [model]"
        problems.add(place, '"command" needs a model of the drives', remedy)
    if rig.controller is None:
        problems.add(tables.place(("controller",)), "is missing", 'describe it, or set drive = "motion"')
    for joint in rig.joints:
        _check_joint(joint, campaign.effects, tables, problems)


def _check_loads(campaign: Campaign, document: Document, tables: Merged, problems: Problems) -> None:
    """What is recorded is described, what is described is recorded, and there is something to compare with."""
    topics, rig = campaign.topics, campaign.rig
    if topics.wrench is None and rig.transducer.channels:
        problems.add(document.place(("topics", "wrench")), "is missing", "name it, or leave [transducer] out")
    if topics.wrench is not None and not rig.transducer.channels:
        problems.add(tables.place(("transducer",)), "is missing", "describe it, or leave topics.wrench out")
    driven = [joint.name for joint in rig.joints if joint.effort is not None]
    if topics.effort is None and driven:
        remedy = f"name it, or leave joint.{driven[0]}.effort out"
        problems.add(document.place(("topics", "effort")), "is missing", remedy)
    if topics.effort is not None and not driven:
        place = tables.place(("joint", rig.joint_names[0], "effort"))
        problems.add(place, "is missing", "describe the joint's effort, or leave topics.effort out")
    if not rig.channels:
        remedy = "name the wrench of a transducer, or the effort of a joint"
        problems.add(document.place(("topics",)), "holds no load to compare a prediction with", remedy)
    for joint in rig.joints if campaign.drive == "command" else ():
        for key, special in (
            ("type", joint.type != "revolute"),
            ("viscous", joint.viscous is not None),
            ("effort", joint.effort is not None),
        ):
            if special:
                place = tables.place(("joint", joint.name, key))
                what = "goes with a rig that its measured motion drives; the model of a drive turns its joint"
                problems.add(place, what, 'leave it out, or set drive = "motion"')


def _check_joint(joint: Joint, effects: tuple[str, ...], tables: Merged, problems: Problems) -> None:
    key: Key = ("joint", joint.name, "drive")
    if joint.drive is None:
        problems.add(tables.place(key), "is missing", 'describe the drive, or set drive = "motion"')
        return
    if not float(joint.drive.rotor_inertia):
        what = "0.0 is out of bounds: a drive that commands turn has a rotor of its own"
        problems.add(tables.place((*key, "rotor_inertia", "value")), what, "give more than 0")
    for effect in catalogue_with(effects):
        if effect.port.of_drive:
            named = effect.name in effects
            _check_parameters(effect, joint.drive.parameters, named, (*key, "parameters"), tables, problems)


def _check_external(campaign: Campaign, tables: Merged, problems: Problems) -> None:
    """Every effect of the laboratory in the model is described, and acts on what hangs on the transducer."""
    described = {external.name: external for external in campaign.rig.external}
    for effect in catalogue_with(campaign.effects):
        key: Key = ("external", effect.name)
        external, named = described.get(effect.name), effect.name in campaign.effects
        if effect.port.of_drive or (external is None and not named):
            continue
        if external is None:
            remedy = "say in a parameter file where it acts and how large it is, or leave the effect out"
            problems.add(tables.place(key), f"is missing, although the model contains '{effect.name}'", remedy)
            continue
        if effect.port is Port.EXTERNAL_FORCE:
            if external.on == LAB:
                what = "'lab' does not hang on the transducer: nothing would feel the force"
                problems.add(tables.place((*key, "on")), what, "name the link that it pulls at")
            if external.point is None:
                remedy = "give the place where it pulls, (x, y, z) in the link's axes"
                problems.add(tables.place((*key, "point")), "is missing", remedy)
        if effect.port is Port.BASE_TORQUE and named and campaign.rig.transducer.stiffness is None:
            what = f"is missing, and '{effect.name}' acts on the angles of a plate that turns"
            remedy = "give the transducer's stiffness, or leave the effect out"
            problems.add(tables.place(("transducer", "stiffness")), what, remedy)
        _check_parameters(effect, external.parameters, named, (*key, "parameters"), tables, problems)


def _check_parameters(
    effect: Effect, given: Mapping[str, Quantity], named: bool, key: Key, tables: Merged, problems: Problems
) -> None:
    for parameter in effect.parameters:
        place = tables.place((*key, parameter.name))
        quantity = given.get(parameter.name)
        if quantity is None and named:
            remedy = f"give it ({parameter.description}, {parameter.unit}), or leave the effect out"
            problems.add(place, f"is missing, although the model contains '{effect.name}'", remedy)
        low, high = parameter.bounds
        if quantity is not None and not low <= float(quantity) <= high:
            what = f"{float(quantity):g} {parameter.unit} is out of bounds"
            problems.add(place, what, f"give {low:g} to {high:g} {parameter.unit}")


def _check_topics(campaign: Campaign, document: Document, problems: Problems) -> None:
    names = {"angle": "encoder"}
    for topic in campaign.topics.present():
        if len(topic.fields) != len(topic.channels):
            problems.add(
                document.place(("topics", names.get(topic.key, topic.key), "fields")),
                f"lists {len(topic.fields)} fields for {len(topic.channels)} channels",
                f"give one for each of {', '.join(topic.channels)}",
            )


def _check_read(campaign: Campaign, document: Document, problems: Problems) -> None:
    """Joints that encoders read are the rig's; of the others commands say, or measured rates, how they move."""
    encoder = document.tree["topics"].get("encoder")
    if not isinstance(encoder, dict) or "joints" not in encoder:
        return
    names = campaign.rig.joint_names
    for index, name in enumerate(encoder["joints"]):
        if name not in names:
            place = document.place(("topics", "encoder", "joints", index))
            problems.add(place, f"there is no joint '{name}'", did_you_mean(name, names))
    unread = [name for name in names if name not in encoder["joints"]]
    if unread and campaign.drive == "motion" and campaign.topics.rate is None:
        what = f"leaves out {', '.join(unread)}, of which no rate is measured either"
        remedy = 'read every joint, name the topic of their rates under [topics], or set drive = "command"'
        problems.add(document.place(("topics", "encoder", "joints")), what, remedy)


def _check_bands(campaign: Campaign, document: Document, problems: Problems) -> None:
    bands = campaign.bands
    place = document.place(("bands", "low_pass_Hz"))
    if bands.low_pass[0] <= bands.high_pass:
        what = f"{bands.low_pass[0]:g} Hz is not above the high-pass, {bands.high_pass:g} Hz"
        problems.add(place, what, "give greater edges, or lower high_pass_Hz")
    if bands.low_pass[-1] > _KEPT * bands.working_rate:
        kept = f"{_KEPT * bands.working_rate:g} Hz"
        what = f"{bands.low_pass[-1]:g} Hz is above {kept}, up to which the working rate keeps everything"
        problems.add(place, what, "raise working_rate_Hz (10 times the greatest edge is plenty)")
    elif campaign.drive == "motion" and bands.working_rate < _DERIVED * bands.low_pass[-1]:
        what = f"{bands.low_pass[-1]:g} Hz is too near to the working rate for accelerations from measured motion"
        problems.add(place, what, f"raise working_rate_Hz to {_DERIVED * bands.low_pass[-1]:g} or more")
    for index, requirement in enumerate(campaign.requirements):
        low, high = requirement.band
        place = document.place(("requirement", index, "band_Hz"))
        if not low < high:
            problems.add(place, f"[{low:g}, {high:g}] is empty", "give the lower edge first")
        elif low < bands.high_pass or high > bands.low_pass[-1]:
            wide = f"{bands.high_pass:g} to {bands.low_pass[-1]:g} Hz"
            problems.add(place, f"reaches beyond the [bands], {wide}", "widen the bands, or narrow this one")
        elif not isclose(low, bands.high_pass) or not any(isclose(high, edge) for edge in bands.low_pass):
            cut = " and ".join(f"{bands.high_pass:g} to {edge:g} Hz" for edge in bands.low_pass)
            what = f"[{low:g}, {high:g}] is not cut, only {cut}: what is judged would not be what is stated"
            problems.add(place, what, "state one of these bands, or change high_pass_Hz or low_pass_Hz")
        if requirement.frame == "S" and campaign.rig.spacecraft is None:
            place = document.place(("requirement", index, "frame"))
            what = '"S" needs to know where the spacecraft\'s centre of mass is'
            problems.add(place, what, 'describe [spacecraft] in a parameter file, or use frame = "T"')


def _check_recording(
    campaign: Campaign, index: int, entry: RecordingEntry, document: Document, problems: Problems
) -> None:
    key: Key = ("recording", index)
    effects = document.tree.get("model", {}).get("effects", [])
    for position, name in enumerate(entry.without):
        if name not in effects:
            remedy = did_you_mean(name, effects) if effects else "leave it out"
            problems.add(document.place((*key, "without", position)), f"the model has no '{name}'", remedy)
    if not entry.path.is_file():
        place = document.place((*key, "file"))
        taken = {other.path.resolve() for other in campaign.recordings}
        problems.add(place, f"the recording '{shown(entry.path)}' does not exist", _neighbour(entry.path, taken))
    if entry.start is not None and entry.end is not None and entry.end <= entry.start:
        place = document.place((*key, "end_s"))
        problems.add(place, f"{entry.end:g} is not after start_s, {entry.start:g}", "give a later end")
    for other in campaign.recordings[:index]:
        if other.name == entry.name:
            place = document.place((*key, "file"))
            what = f"a recording before it is called '{entry.name}' too, and results are named by it"
            problems.add(place, what, "rename one of the files, or list it once")
        elif (other.trajectory, other.repeat) == (entry.trajectory, entry.repeat):
            place = document.place((*key, "repeat"))
            what = f"run {entry.repeat} of {entry.trajectory} is '{other.name}' already"
            problems.add(place, what, "number the repeats 1, 2, 3")


def _neighbour(missing: Path, taken: Collection[Path]) -> str:
    """Return a remedy for a file that is missing: one in its folder with a like name, not taken; or where to put it."""
    if not missing.parent.is_dir():
        return f"the folder '{shown(missing.parent)}' does not exist either: put the recordings there"
    others = [path for path in missing.parent.iterdir() if path.is_file()]
    listed = [path.name for path in others if path.resolve() in taken]
    names = [path.name for path in others]
    return did_you_mean(missing.name, names, listed) if names else "its folder is empty: put the recordings there"


def _check_checksum(index: int, entry: RecordingEntry, document: Document, problems: Problems) -> None:
    if entry.sha256 is None or (found := sha256(entry.path)) == entry.sha256:
        return
    problems.add(
        document.place(("recording", index, "sha256")),
        f"'{shown(entry.path)}' has the SHA-256 {found}, not {entry.sha256} as stated",
        "fetch the recording again, or, if it is the right one, state its checksum here",
    )
