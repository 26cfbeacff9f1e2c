"""The description of an imported campaign: the template's text and parameter files, with new recordings."""

from __future__ import annotations

import re
import shutil
import tomllib
from collections import Counter
from collections.abc import Iterator
from collections.abc import Mapping as MappingOf
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kbs_process.campaign.config import Campaign
from kbs_process.campaign.documents import Document, read, shown
from kbs_process.campaign.load import load_campaign
from kbs_process.campaign.locate import CAMPAIGN_FILE
from kbs_process.campaign.writing.parameter_files import value_text
from kbs_process.errors import ConfigError, KbsError, did_you_mean
from kbs_process.files import regular
from kbs_process.reduction.reading import OPTIONAL_STREAMS
from kbs_process.studies.convert.mapping import Mapping
from kbs_process.studies.convert.orientation import Attitude

_HEADER = re.compile(r"^\s*\[")
_REPLACED = re.compile(r"^\s*\[\[?\s*(recording|source)\s*[\].]")


@dataclass(frozen=True, slots=True)
class Origin:
    """A source file that was read."""

    name: str
    sha256: str
    findings: tuple[str, ...]


def recording_file(stem: str) -> str:
    """Return where in a campaign's folder a recording lies."""
    return f"recordings/{stem}.mcap"


def prepare(mapping: Mapping, folder: Path) -> Campaign:
    """Put everything but the recordings' contents into `folder`, and check it as any campaign is.

    So a fault of the description shows before hours of conversion, not after.
    """
    template = read(mapping.template, role="the mapping's campaign", remedy="correct `campaign` in the mapping")
    for name in _parameter_files(template):
        parameters = read(
            template.path.parent / name,
            role="the campaign's parameter file",
            remedy=f"correct [parameters] files in {shown(template.path)}",
        )
        _copy(template, name, folder)
        for matrix in _matrices(parameters.tree):
            _copy(template, matrix, folder)
    for part in mapping.parts:
        placeholder = folder / recording_file(part.stem)
        placeholder.parent.mkdir(parents=True, exist_ok=True)
        placeholder.touch()
    write_campaign(mapping, folder, {}, ())
    try:
        campaign = load_campaign(folder, checksums=False)
    except ConfigError as error:
        # The user knows the template, whose lines are the same, not our private folder.
        raise _elsewhere(error, shown(folder), shown(mapping.template.parent)) from error
    _check_streams(mapping, campaign)
    for one in (one for stream in mapping.streams for one in stream.orientations):
        Attitude(one, campaign.rig, shown(mapping.path))
    return campaign


def _elsewhere(error: KbsError, here: str, there: str) -> ConfigError:
    """Return an error that speaks of another folder."""
    what, where = (text.replace(here, there) for text in (error.what, error.where))
    each = [_elsewhere(one, here, there) for one in error.each]
    return ConfigError(what, where=where, remedy=error.remedy, each=each)


def write_campaign(mapping: Mapping, folder: Path, checksums: MappingOf[str, str], origins: tuple[Origin, ...]) -> None:
    """Write campaign.toml: the template's text without its recordings, then those of the mapping."""
    template = read(mapping.template, role="the mapping's campaign", remedy="correct `campaign` in the mapping")
    blocks = [_without_recordings(template)]
    for part in mapping.parts:
        table: dict[str, Any] = {
            "file": recording_file(part.stem),
            "trajectory": part.trajectory,
            "role": part.role,
            "repeat": part.repeat,
        }
        if part.shift_s:
            table["clock_sigma_s"] = part.shift_sigma_s
        if part.stem in checksums:
            table["sha256"] = checksums[part.stem]
        blocks.append("[[recording]]\n" + _lines(table))
    stated = {name: text for name in ("origin", "licence", "reference") if (text := getattr(mapping.source, name))}
    blocks.append("[source]\n" + _lines(stated))
    for origin in origins:
        row: dict[str, Any] = {"name": origin.name, "sha256": origin.sha256}
        if origin.findings:
            row["findings"] = list(origin.findings)
        blocks.append("[[source.file]]\n" + _lines(row))
    (folder / CAMPAIGN_FILE).write_text("\n".join(blocks), encoding="utf-8")


def _parameter_files(template: Document) -> list[str]:
    files = template.tree.get("parameters", {}).get("files", [])
    return [name for name in files if isinstance(name, str)]


def _matrices(node: Any) -> Iterator[str]:
    """Yield the names of the CSV files that hold values or sigmas of quantities."""
    for name, value in node.items() if isinstance(node, dict) else ():
        if name in ("value", "sigma") and isinstance(value, str):
            yield value
        else:
            yield from _matrices(value)


def _copy(template: Document, name: str, folder: Path) -> None:
    """Copy a file of the template's folder to the same place in `folder`."""
    source, target = template.path.parent / name, folder / name
    if not target.resolve().is_relative_to(folder.resolve()):
        raise ConfigError(
            f"'{name}' lies outside the campaign",
            where=shown(template.path),
            remedy="copy it into the campaign's folder",
        )
    target.parent.mkdir(parents=True, exist_ok=True)
    try:
        shutil.copyfile(regular(source), target)
    except FileNotFoundError as error:
        beside = [path.name for path in source.parent.iterdir()] if source.parent.is_dir() else []
        raise ConfigError(
            f"the campaign's file '{name}' does not exist",
            where=shown(template.path),
            remedy=did_you_mean(source.name, beside),
        ) from error
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error  # a name with a NUL in it
        what = f"the campaign's file '{name}' cannot be read: {reason}"
        raise ConfigError(what, where=shown(template.path), remedy="name a file that can be read") from error


def _without_recordings(template: Document) -> str:
    """Return the template's text, comments and all, without its [[recording]] and [source] tables."""
    kept: list[str] = []
    dropping = False
    for line in template.text.splitlines():
        if _HEADER.match(line):
            dropping = bool(_REPLACED.match(line))
        if not dropping:
            kept.append(line)
    text = "\n".join(kept).rstrip() + "\n"
    wanted = {name: value for name, value in template.tree.items() if name not in ("recording", "source")}
    if tomllib.loads(text) != wanted:
        raise ConfigError(
            "recordings and source are written in a way that cannot be cut out",
            where=shown(template.path),
            remedy="write them as [[recording]] and [source] tables at the end, or leave them out",
        )
    return text


def _lines(table: MappingOf[str, Any]) -> str:
    """Return `key = value` lines."""
    return "".join(f"{name} = {value_text(value)}\n" for name, value in table.items())


def _check_streams(mapping: Mapping, campaign: Campaign) -> None:
    """Check that the mapping fills exactly the channels that the campaign reads."""
    topics = campaign.topics
    read = {"encoder" if topic.key == "angle" else topic.key: topic for topic in topics.present()}
    wanted = {key: topic.fields for key, topic in read.items()}
    given = {stream.key: set(stream.units) for stream in mapping.streams}
    named = Counter(topic.topic for topic in topics.present())
    if shared := [name for name, count in named.items() if count > 1]:
        raise ConfigError(
            f"'{shared[0]}' carries {named[shared[0]]} streams; an imported recording has one topic for each",
            where=f"{shown(mapping.template)}: topics",
            remedy="name different topics",
        )
    for key in sorted(wanted.keys() | given.keys()):
        if key in OPTIONAL_STREAMS - given.keys():
            continue
        missing = set(wanted.get(key, ())) - given.get(key, set())
        unread = given.get(key, set()) - set(wanted.get(key, ()))
        if missing:
            raise ConfigError(
                f"[{key}] does not map {', '.join(sorted(missing))}, which the campaign reads",
                where=shown(mapping.path),
                remedy=f"map it, or change topics or rig of {shown(mapping.template)}",
            )
        if unread:
            raise ConfigError(
                f"[{key}] maps {', '.join(sorted(unread))}, which the campaign does not read",
                where=shown(mapping.path),
                remedy=did_you_mean(min(unread), wanted.get(key, ()))
                if key in wanted
                else f"name a topic for '{key}' in [topics] of {shown(mapping.template)}",
            )
    for stream in mapping.streams:
        topic = read[stream.key]
        units = dict(zip(topic.fields, topic.units, strict=True))
        for field, unit in stream.units.items():
            if unit != units[field]:
                raise ConfigError(
                    f"[{stream.key}] gives {field} in {unit}, which the campaign reads in {units[field]}",
                    where=shown(mapping.path),
                    remedy="correct unit and scale, or the joint's type or effort in the rig of "
                    f"{shown(mapping.template)}",
                )
