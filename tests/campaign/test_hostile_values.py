"""Whatever a file holds at a key, loading ends well or with a fault that has its place and is told in our words."""

from __future__ import annotations

import copy
import shutil
import time
import tomllib
from collections.abc import Callable, Iterator
from functools import partial
from itertools import cycle, islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from campaign.campaign_folder import make_folder
from kbs_process.campaign.documents import Document
from kbs_process.campaign.formats.campaign_file import CampaignFile
from kbs_process.campaign.formats.faults import checked
from kbs_process.campaign.formats.mission_file import MissionFile
from kbs_process.campaign.formats.modal_file import ModalFile
from kbs_process.campaign.formats.parameter_file import ParameterFile
from kbs_process.campaign.formats.tables import Table
from kbs_process.campaign.load import load_campaign
from kbs_process.campaign.mission import load_day
from kbs_process.campaign.modal_file import read_modal
from kbs_process.campaign.problems import Problems
from kbs_process.campaign.writing.modal_file import modal_text
from kbs_process.campaign.writing.parameter_files import text_of
from kbs_process.errors import ConfigError
from kbs_process.plant.laws import select
from kbs_process.plant.linear.modal import derive
from mission.reference import FOLDER as MISSION
from plant.plant_rigs import NOMINAL, two_axis

Key = tuple[str | int, ...]
Load = Callable[[], object]

# By what is there very often: what one of it is.
MANY = {
    "keys": "x{} = 1\n",
    "tables": "[y{}]\nx = 1\n",
    "broken recordings": "[[recording]]\nfile = 3\n",
    "recordings": '[[recording]]\nfile = "r{}.mcap"\nrole = "fit"\ntrajectory = "t{}"\n',
    "brackets in a text": "[    \n",
}

# As TOML.
VALUES = (
    "true", "0", "-1", "1" + "0" * 400, "-1" + "0" * 400, "1" * 5000, "0x" + "f" * 5000, "1e308", "-1e308", "5e-324",
    "nan", "-inf", '""', '"lab"', '"\\u0000"', f'"{"x" * 5000}"', '"a\\nb"', "[]", "[[]]", "[[1.0], [2.0, 3.0]]",
    "[[[1.0]]]", "[" * 200 + "]" * 200, "[true]", "[1e308, 1e308, 1e308]", '["Fx", 3]', "{}", '{ "" = 1 }',
    "[1e308, 1e308, 1e308, 1e308, 1e308, 1e308]", "{ value = {} }", '{ "\\u0000" = { "a.b" = 1 } }', "[{}]",
    "0001-01-01", "23:59:00", "0001-01-01T00:00:00", "0001-01-01T00:00:00+23:59", "9999-12-31T23:59:59-23:59",
)  # fmt: skip
HERE = "the value goes here"
READ = [tomllib.loads(f"value = {text}")["value"] for text in VALUES if text.strip("1")]


def keys(node: Any, key: Key = ()) -> Iterator[Key]:
    """Yield the keys of all tables, lists and values of a tree: of a list's elements, of bodies and of joints one."""
    alike = isinstance(node, list) or key[-1:] in (("body",), ("joint",), ("relay",), ("parameters",))
    children: Any = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for name, child in list(children)[: 1 if alike and key != ("parameters",) else None]:
        yield (*key, name)
        yield from keys(child, (*key, name))


def changed(tree: dict[str, Any], key: Key, value: Any) -> dict[str, Any]:
    """Return a tree with a value in the place of what is at a key."""
    tree = copy.deepcopy(tree)
    node: Any = tree
    for part in key[:-1]:
        node = node[part]
    node[key[-1]] = value
    return tree


# What the example leaves out.
OPTIONAL = """
[topics.encoder]
topic = "/encoder"
fields = ["position[az]", "position[el]"]
joints = ["az", "el"]
[[model.sensing]]
law = "channel_gain"
site = "Fx"
[model.sensing.parameters.gain]
value = 0.01
unit = "1"
sigma = 0.001
source = "calibration"
[[flight.pointing]]
name = "bias"
statistic = "bias"
limit = { value = 1.0, unit = "mrad" }
source = "specification"
[source]
origin = "a laboratory"
licence = "none"
reference = "none"
[[source.file]]
name = "a.csv"
sha256 = "0000000000000000000000000000000000000000000000000000000000000000"
findings = ["none"]
[mission]
file = "mission.toml"
"""


def campaign(tmp_path: Path, name: str) -> tuple[Path, Load]:
    folder = make_folder(tmp_path / "campaign")
    if name == "campaign.toml":
        folder.replace(name, 'encoder = "/encoder"', "")
        folder.append(name, OPTIONAL)
        folder.replace(name, 'role = "fit"', 'role = "fit"\nstart_s = 0.0\nend_s = 9.0\nwithout = ["cogging"]')
    return folder.path / name, lambda: load_campaign(folder.path)


def mission(tmp_path: Path, name: str) -> tuple[Path, Load]:
    folder = tmp_path / "REFDAY"
    shutil.copytree(MISSION, folder)
    described = load_campaign(folder, recordings=False)
    return folder / name, lambda: load_day(described)


def modal(tmp_path: Path, name: str) -> tuple[Path, Load]:
    path = tmp_path / name
    table = derive(two_axis(), select(NOMINAL), "el", np.radians([70.0, 80.0]), np.zeros(2))
    path.write_text(modal_text(table))
    return path, lambda: read_modal(path, ("az", "el"))


FILES = [
    (campaign, "campaign.toml", CampaignFile),
    (campaign, "parameters/rig.toml", ParameterFile),
    (campaign, "parameters/drives.toml", ParameterFile),
    (mission, "mission.toml", MissionFile),
    (modal, "modes.toml", ModalFile),
]


@pytest.mark.slow
@pytest.mark.parametrize(("make", "name", "model"), FILES, ids=[name for _, name, _ in FILES])
def test_every_key_takes_any_value_or_tells_its_fault(
    make: Callable[[Path, str], tuple[Path, Load]], name: str, model: type[Table], tmp_path: Path
) -> None:
    path, load = make(tmp_path, name)
    tree = tomllib.loads(path.read_text(encoding="utf-8"))
    load()
    values = cycle(VALUES)
    for key in keys(tree):
        # Each key has all values with the format alone, and some of them with all that is read and checked.
        for value in READ:
            judged(partial(checked, Document(path, "", changed(tree, key, value)), model, Problems("")))
        for text in islice(values, 2):
            path.write_text(text_of(changed(tree, key, HERE)).replace(f'"{HERE}"', text), encoding="utf-8")
            judged(load)


def judged(load: Load) -> None:
    """Load, and ask of the fault, if there is one, that it says where it is and is ours to tell."""
    try:
        load()
    except ConfigError as error:
        assert error.where or "things are wrong" in error.what
        for word in ("pydantic", "Input should", "see the format's schema", "Traceback"):
            assert word not in str(error)


@pytest.mark.slow
@pytest.mark.parametrize("many", MANY)
def test_time_grows_as_the_description_does(many: str, tmp_path: Path) -> None:
    folder = make_folder(tmp_path / "a").path
    text = (folder / "campaign.toml").read_text()

    def refused(count: int) -> float:
        lines = "".join(MANY[many].replace("{}", str(number)) for number in range(count))
        lines = f'text = """\n{lines}"""\n' if "text" in many else lines
        (folder / "campaign.toml").write_text(lines + text if "[" not in lines or "text" in many else text + lines)
        start = time.perf_counter()
        with pytest.raises(ConfigError):
            load_campaign(folder)
        return time.perf_counter() - start

    refused(10)
    assert min(refused(4000) for _ in range(2)) < 16.0 * max(min(refused(500) for _ in range(2)), 0.1)
