"""From a campaign's folder to a checked Campaign."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from kbs_process.campaign.checks import check_campaign
from kbs_process.campaign.config import Bands, Campaign, RecordingEntry, SensingLaw, Topic, Topics
from kbs_process.campaign.documents import Document, Merged, Tree, check_finite, merge, read, substituted
from kbs_process.campaign.locate import CAMPAIGN_FILE
from kbs_process.campaign.problems import Problems
from kbs_process.campaign.requirements import disturbance, pointing
from kbs_process.campaign.rig_builder import RigBuilder
from kbs_process.campaign.schema import violations
from kbs_process.plant.laws import catalogue_with, select
from kbs_process.rig.model import Rig
from kbs_process.signals.records import WRENCH_CHANNELS, WRENCH_UNITS


def load_campaign(folder: Path, *, checksums: bool = True, flight: bool = False, recordings: bool = True) -> Campaign:
    """Read and check the campaign in `folder`.

    Raises ConfigError with the file, the key and the remedy of up to five faults. `checksums` says
    whether recordings are read through to compare the SHA-256 that the campaign states; with `flight`, the
    parameters of the flight model take the place of those of the test, and the laboratory stays behind. Without
    `recordings` there need be none, and those that are listed need not be there.
    """
    folder = folder.absolute()
    problems = Problems(subject=str(folder))
    document = read(
        folder / CAMPAIGN_FILE, role="the campaign's description", remedy="name a folder that holds a campaign.toml"
    )
    check_finite(document, problems)
    _check_schema(document, "campaign", problems)
    problems.raise_any()

    tables = _read_parameters(folder, document.tree["parameters"]["files"], problems)
    if flight:
        tables = _substitute_flight(folder, document, tables, problems)
    known = catalogue_with(document.tree.get("model", {}).get("effects", []))
    units = {effect: {entry.name: entry.unit for entry in effect.parameters} for effect in known}
    of_drives = {name: unit for effect, own in units.items() if effect.port.of_drive for name, unit in own.items()}
    of_rig = {effect.name: own for effect, own in units.items() if not effect.port.of_drive}
    rig = RigBuilder(tables, folder, of_drives, of_rig, problems).build()
    problems.raise_any()

    campaign = _campaign(folder, document, tables, rig, problems)
    if flight:
        article = document.tree["flight"].get("article", campaign.article)
        flown = tuple(effect.name for effect in select(campaign.effects) if effect.flies)
        campaign = replace(campaign, article=article, effects=flown, rig=replace(rig, external=()))
    if recordings and not campaign.recordings:
        remedy = "add [[recording]], or simulate the campaign's mission: kbs-process reference-day"
        problems.add(document.place(("recording",)), "is missing: there is nothing to read", remedy)
    there = campaign if recordings else replace(campaign, recordings=())
    check_campaign(there, document, tables, problems, checksums=checksums)
    problems.raise_any()
    if campaign.modal is not None:
        # Few campaigns have one, and what reads it takes its time to import.
        from kbs_process.campaign.modal_file import read_modal

        read_modal(campaign.modal, rig.joint_names)
    return campaign


def _check_schema(document: Document, schema: str, problems: Problems) -> None:
    for violation in violations(document.tree, schema):
        problems.add(document.place(violation.key), violation.what, violation.remedy)


def _read_parameters(folder: Path, files: Iterable[str], problems: Problems) -> Merged:
    """Read all parameter files as one tree, each checked alone and then all together."""
    tables = merge(_read_each(folder, files, "[parameters] files", problems), problems)
    if not problems.found:
        for violation in violations(tables.tree, "parameters", "complete"):
            problems.add(tables.place(violation.key), violation.what, violation.remedy)
    problems.raise_any()
    return tables


def _substitute_flight(folder: Path, document: Document, tables: Merged, problems: Problems) -> Merged:
    """Put what [flight] says of the flight model in the place of what was tested."""
    if "flight" not in document.tree:
        remedy = 'add [flight] with substitute = ["parameters/flight.toml"], or an empty list to fly what was tested'
        problems.add(document.place(("flight",)), "is missing: nothing is said of the flight model", remedy)
        problems.raise_any()
    files = document.tree["flight"]["substitute"]
    other = substituted(tables, _read_each(folder, files, "[flight] substitute", problems))
    problems.raise_any()
    return other


def _read_each(folder: Path, files: Iterable[str], key: str, problems: Problems) -> list[Document]:
    remedy = f"correct {key} in {CAMPAIGN_FILE}, or add the file"
    documents = [read(folder / name, role="the parameter file", remedy=remedy) for name in files]
    for document in documents:
        check_finite(document, problems)
        _check_schema(document, "parameters", problems)
    return documents


def _campaign(folder: Path, document: Document, tables: Merged, rig: Rig, problems: Problems) -> Campaign:
    tree = document.tree
    effects = tree.get("model", {}).get("effects", [])
    modal = folder / tree["model"]["modal"] if "modal" in tree.get("model", {}) else None
    requirements = (
        disturbance(table, ("requirement", index), document, problems)
        for index, table in enumerate(tree.get("requirement", []))
    )
    bands = tree["bands"]
    return Campaign(
        folder=folder,
        name=tree["name"],
        title=tree["title"],
        article=tree.get("article", ""),
        configuration=tree.get("configuration", ""),
        drive=tree["drive"],
        requirements=tuple(requirements),
        bands=Bands(
            high_pass=float(bands["high_pass_Hz"]),
            low_pass=tuple(sorted(float(edge) for edge in bands["low_pass_Hz"])),
            working_rate=float(bands["working_rate_Hz"]),
        ),
        topics=_topics(tree["topics"], rig),
        effects=tuple(effect.name for effect in catalogue_with(effects) if effect.name in effects),
        recordings=tuple(_recording(folder, table) for table in tree.get("recording", [])),
        rig=rig,
        inputs=(
            document.path,
            *(entry.path for entry in tables.documents),
            *_matrices(folder, tables.tree),
            *(() if modal is None else (modal,)),
        ),
        mission=folder / tree["mission"]["file"] if "mission" in tree else None,
        flight_pointing=tuple(
            pointing(table, ("flight", "pointing", index), document, problems)
            for index, table in enumerate(tree.get("flight", {}).get("pointing", []))
        ),
        modal=modal,
        sensing=_sensing(document, rig, problems),
    )


def _sensing(document: Document, rig: Rig, problems: Problems) -> tuple[SensingLaw, ...]:
    if "sensing" not in document.tree.get("model", {}):
        return ()
    # Few campaigns have one, and the laws take their time to import.
    from kbs_process.campaign.sensing_laws import read_sensing

    return read_sensing(document, rig, problems)


def _topics(tree: Tree, rig: Rig) -> Topics:
    joints = {joint.name: joint.unit for joint in rig.joints}
    rates = {name: f"{unit}/s" for name, unit in joints.items()}
    wrench = {channel: WRENCH_UNITS[WRENCH_CHANNELS.index(channel)] for channel in rig.transducer.channels}
    efforts = {joint.name: joint.effort.unit for joint in rig.joints if joint.effort is not None}
    position = tuple(f"position[{name}]" for name in joints)
    velocity = tuple(f"velocity[{name}]" for name in joints)
    given = tree.get("encoder")
    listed = given.get("joints", joints) if isinstance(given, dict) else joints
    read = {name: unit for name, unit in joints.items() if name in listed}
    components = tuple(f"wrench.{'force' if channel[0] == 'F' else 'torque'}.{channel[1]}" for channel in wrench)

    def topic(name: str, key: str, fields: tuple[str, ...], units: dict[str, str]) -> Topic | None:
        given = tree.get(name)
        if given is None:
            return None
        if isinstance(given, dict):
            fields = tuple(given.get("fields", fields))
            given = given["topic"]
        return Topic(key, given, fields, tuple(units), tuple(units.values()))

    return Topics(
        wrench=topic("wrench", "wrench", components, wrench),
        effort=topic(
            "effort",
            "effort",
            tuple(f"effort[{name}]" for name in efforts),
            {f"{name}.effort": unit for name, unit in efforts.items()},
        ),
        angle=topic("encoder", "angle", tuple(f"position[{name}]" for name in read), read),
        rate=topic("rate", "rate", velocity, rates),
        command=topic(
            "command", "command", position + velocity, joints | {f"{name}.rate": unit for name, unit in rates.items()}
        ),
        field=topic("field", "field", position, dict.fromkeys(joints, "rad")),
        temperature=topic("temperature", "temperature", ("temperature",), {"temperature": "degC"}),
        pointing=topic("pointing", "pointing", position, joints),
    )


def _recording(folder: Path, table: Tree) -> RecordingEntry:
    path = folder / table["file"]
    return RecordingEntry(
        name=path.stem,
        path=path,
        trajectory=table["trajectory"],
        role=table["role"],
        repeat=table.get("repeat", 1),
        sha256=table.get("sha256"),
        start=table.get("start_s"),
        end=table.get("end_s"),
        without=tuple(table.get("without", ())),
    )


def _matrices(folder: Path, node: object) -> tuple[Path, ...]:
    """Return the CSV files that quantities refer to."""
    if not isinstance(node, dict):
        return ()
    if "value" in node:
        files = (node[key] for key in ("value", "sigma") if isinstance(node[key], str))
        return tuple(folder / name for name in files)
    return tuple(path for child in node.values() for path in _matrices(folder, child))
