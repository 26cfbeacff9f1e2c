"""From a campaign's folder to a checked Campaign."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from kbs_process.campaign.checks import check_campaign
from kbs_process.campaign.config import Bands, Campaign, RecordingEntry, SensingLaw, Topic, Topics
from kbs_process.campaign.documents import Document, Merged, merge, read, shown, substituted, within
from kbs_process.campaign.formats.campaign_file import (
    CampaignFile,
    EncoderTable,
    RecordingTable,
    TopicsTable,
    TopicTable,
)
from kbs_process.campaign.formats.faults import checked
from kbs_process.campaign.formats.parameter_file import ParameterFile
from kbs_process.campaign.locate import CAMPAIGN_FILE
from kbs_process.campaign.problems import Problems
from kbs_process.campaign.requirements import disturbance, pointing
from kbs_process.campaign.rig_builder import RigBuilder
from kbs_process.plant.laws import catalogue_with, select
from kbs_process.rig.model import Rig
from kbs_process.signals.records import WRENCH_CHANNELS, WRENCH_UNITS


def load_campaign(
    folder: Path, *, checksums: bool = True, flight: bool = False, recordings: bool = True, mission_alone: bool = False
) -> Campaign:
    """Read and check the campaign in `folder`.

    Raises ConfigError with the file, the key and the remedy of up to five faults. `checksums` says
    whether recordings are read through to compare the SHA-256 that the campaign states; with `flight`, the
    parameters of the flight model take the place of those of the test, and the laboratory stays behind. Without
    `recordings` there need be none in a campaign with a mission, and those that are listed need not be there; with
    `mission_alone` there need be none either, and those that are listed are checked.
    """
    folder = folder.absolute()
    problems = Problems(subject=str(folder))
    document = read(
        folder / CAMPAIGN_FILE, role="the campaign's description", remedy="name a folder that holds a campaign.toml"
    )
    if "recording" not in document.tree and ("mission" not in document.tree or (recordings and not mission_alone)):
        remedy = "add [[recording]], or simulate the campaign's mission: kbs-process reference-day"
        problems.add(document.place(("recording",)), "is missing: there is nothing to read", remedy)
    file = checked(document, CampaignFile, problems)

    tables = merge(_read_each(folder, file.parameters.files, "[parameters] files"), problems)
    given = checked(tables, ParameterFile, problems)
    if flight:
        tables = _substitute_flight(folder, file, document, tables, problems)
        given = checked(tables, ParameterFile, problems)
    rig = RigBuilder(given, tables, folder, catalogue_with(file.effects), problems).build()
    problems.raise_any()

    campaign = _campaign(folder, file, document, tables, rig, problems)
    if flight and file.flight is not None:
        article = file.flight.article or campaign.article
        flown = tuple(effect.name for effect in select(campaign.effects) if effect.flies)
        campaign = replace(campaign, article=article, effects=flown, rig=replace(rig, external=()))
    there = campaign if recordings else replace(campaign, recordings=())
    check_campaign(there, file, document, tables, problems, checksums=checksums)
    problems.raise_any()
    if campaign.modal is not None:
        # Few campaigns have one, and what reads it takes its time to import.
        from kbs_process.campaign.modal_file import read_modal

        read_modal(campaign.modal, rig.joint_names)
    return campaign


def _substitute_flight(
    folder: Path, file: CampaignFile, document: Document, tables: Merged, problems: Problems
) -> Merged:
    """Put what [flight] says of the flight model in the place of what was tested."""
    if file.flight is None:
        remedy = 'add [flight] with substitute = ["parameters/flight.toml"], or an empty list to fly what was tested'
        problems.add(document.place(("flight",)), "is missing: nothing is said of the flight model", remedy)
        problems.raise_any()
        return tables
    return substituted(tables, _read_each(folder, file.flight.substitute, "[flight] substitute"))


def _read_each(folder: Path, files: Iterable[str], key: str) -> list[Document]:
    remedy = f"correct {key} in {CAMPAIGN_FILE}, or add the file"
    where = shown(folder / CAMPAIGN_FILE)
    paths = [within(folder, name, where=f"{where}: {key}") for name in files]
    return [read(path, role="the parameter file", remedy=remedy) for path in paths]


def _campaign(
    folder: Path, file: CampaignFile, document: Document, tables: Merged, rig: Rig, problems: Problems
) -> Campaign:
    modal, mast = (
        within(folder, name, where=document.place(key)) if name else None
        for key, name in (
            (("model", "modal"), file.model and file.model.modal),
            (("mission", "mast"), file.mission and file.mission.mast),
        )
    )
    requirements = (
        disturbance(table, ("requirement", index), document, problems) for index, table in enumerate(file.requirement)
    )
    return Campaign(
        folder=folder,
        name=file.name,
        title=file.title,
        article=file.article,
        configuration=file.configuration,
        drive=file.drive,
        requirements=tuple(requirements),
        bands=Bands(
            high_pass=file.bands.high_pass_Hz,
            low_pass=tuple(sorted(file.bands.low_pass_Hz)),
            working_rate=file.bands.working_rate_Hz,
        ),
        topics=_topics(file.topics, rig),
        effects=tuple(effect.name for effect in catalogue_with(file.effects) if effect.name in file.effects),
        recordings=tuple(_recording(folder, table) for table in file.recording),
        rig=rig,
        inputs=(
            document.path,
            *(entry.path for entry in tables.documents),
            *_matrices(folder, tables.tree),
            *(path for path in (modal, mast) if path is not None),
        ),
        mast=mast,
        mission=within(folder, file.mission.file, where=document.place(("mission", "file"))) if file.mission else None,
        pointing=pointing(file.pointing, ("pointing",), document, problems),
        flight_pointing=pointing(
            file.flight.pointing if file.flight else (), ("flight", "pointing"), document, problems
        ),
        document=file.document.model_dump(exclude_none=True),
        modal=modal,
        sensing=_sensing(file, document, rig, problems),
        sources={one.name: one.sha256 for one in file.source.file} if file.source else {},
    )


def _sensing(file: CampaignFile, document: Document, rig: Rig, problems: Problems) -> tuple[SensingLaw, ...]:
    if file.model is None or not file.model.sensing:
        return ()
    # Few campaigns have one, and the laws take their time to import.
    from kbs_process.campaign.sensing_laws import read_sensing

    return read_sensing(file.model.sensing, document, rig, problems)


def _topics(named: TopicsTable, rig: Rig) -> Topics:
    joints = {joint.name: joint.unit for joint in rig.joints}
    rates = {name: f"{unit}/s" for name, unit in joints.items()}
    wrench = {channel: WRENCH_UNITS[WRENCH_CHANNELS.index(channel)] for channel in rig.transducer.channels}
    efforts = {joint.name: joint.effort.unit for joint in rig.joints if joint.effort is not None}
    position = tuple(f"position[{name}]" for name in joints)
    velocity = tuple(f"velocity[{name}]" for name in joints)
    listed = (named.encoder.joints if isinstance(named.encoder, EncoderTable) else None) or joints
    read = {name: unit for name, unit in joints.items() if name in listed}
    components = tuple(f"wrench.{'force' if channel[0] == 'F' else 'torque'}.{channel[1]}" for channel in wrench)

    def topic(given: str | TopicTable | None, key: str, fields: tuple[str, ...], units: dict[str, str]) -> Topic | None:
        if given is None:
            return None
        channel = None
        if isinstance(given, TopicTable):
            fields, channel = tuple(given.fields_ or fields), given.channel
            given = given.topic
        return Topic(key, given, fields, tuple(units), tuple(units.values()), channel)

    both = joints | {f"{name}.rate": unit for name, unit in rates.items()}
    effort_units = {f"{name}.effort": unit for name, unit in efforts.items()}
    return Topics(
        wrench=topic(named.wrench, "wrench", components, wrench),
        effort=topic(named.effort, "effort", tuple(f"effort[{name}]" for name in efforts), effort_units),
        angle=topic(named.encoder, "angle", tuple(f"position[{name}]" for name in read), read),
        rate=topic(named.rate, "rate", velocity, rates),
        command=topic(named.command, "command", position + velocity, both),
        field=topic(named.field, "field", position, dict.fromkeys(joints, "rad")),
        temperature=topic(named.temperature, "temperature", ("temperature",), {"temperature": "degC"}),
        pointing=topic(named.pointing, "pointing", position, joints),
        accelerometer=topic(
            named.accelerometer,
            "accelerometer",
            tuple(f"linear_acceleration.{axis}" for axis in "xyz"),
            dict.fromkeys("xyz", "m/s^2"),
        ),
        gyro=topic(
            named.gyro, "gyro", tuple(f"angular_velocity.{axis}" for axis in "xyz"), dict.fromkeys("xyz", "rad/s")
        ),
    )


def _recording(folder: Path, table: RecordingTable) -> RecordingEntry:
    path = folder / table.file
    return RecordingEntry(
        name=path.stem,
        path=path,
        trajectory=table.trajectory,
        role=table.role,
        repeat=table.repeat,
        sha256=table.sha256,
        start=table.start_s,
        end=table.end_s,
        without=tuple(table.without),
        clock_sigma=table.clock_sigma_s,
    )


def _matrices(folder: Path, node: object) -> tuple[Path, ...]:
    """Return the CSV files that quantities refer to."""
    if not isinstance(node, dict):
        return ()
    if "value" in node:
        files = (node[key] for key in ("value", "sigma") if isinstance(node[key], str))
        return tuple(folder / name for name in files)
    return tuple(path for child in node.values() for path in _matrices(folder, child))
