"""Laws of sensors and clocks that a campaign's model names: read and checked."""

from __future__ import annotations

from collections.abc import Sequence

from kbs_process.campaign.config import SensingLaw
from kbs_process.campaign.documents import Document, Key
from kbs_process.campaign.formats.campaign_file import SensingTable
from kbs_process.campaign.formats.kind import Kind
from kbs_process.campaign.problems import Problems
from kbs_process.campaign.quantities import read_quantity
from kbs_process.errors import ConfigError, did_you_mean
from kbs_process.plant.laws import SENSING
from kbs_process.plant.sensing import Sensing
from kbs_process.rig.model import Quantity, Rig

KEY = ("model", "sensing")


def belongs_to_model(law: Sensing) -> bool:
    """Whether a law is the same in every recording; what drifts or hums has numbers of its own each time."""
    return not law.each_trial


LAWS = {law.name: law for law in SENSING if belongs_to_model(law)}


def read_sensing(
    tables: Sequence[SensingTable], document: Document, rig: Rig, problems: Problems
) -> tuple[SensingLaw, ...]:
    """Return the laws under [model] sensing; what is wrong with them is noted."""
    found = (_law(table, (*KEY, index), document, rig, problems) for index, table in enumerate(tables))
    return tuple(law for law in found if law is not None)


def _law(table: SensingTable, key: Key, document: Document, rig: Rig, problems: Problems) -> SensingLaw | None:
    law = LAWS.get(table.law)
    if law is None:
        what = f"'{table.law}' is no law of a sensor that a model can contain"
        problems.add(document.place((*key, "law")), what, did_you_mean(table.law, LAWS))
        return None
    sites = law.port.sites(rig.channels, rig.transducer.channels, rig.joint_names)
    if table.site not in sites:
        what = f"'{table.site}' is no site of '{law.name}'"
        problems.add(document.place((*key, "site")), what, did_you_mean(table.site, sites))
    units = {entry.name: entry.unit for entry in law.parameters}
    given = table.parameters
    for name in sorted(set(units) ^ set(given)):
        what = f"has no '{name}'" if name in units else f"'{name}' is no parameter of '{law.name}'"
        problems.add(document.place((*key, "parameters")), what, did_you_mean(name, units))
    quantities: dict[str, Quantity] = {}
    for name in [name for name in given if name in units]:
        try:
            path = f"sensing.{table.site}.{law.name}.{name}"
            quantities[name] = read_quantity(path, given[name], Kind(units[name]), document.path.parent)
        except ConfigError as error:
            problems.add(document.place((*key, "parameters", name)), error.what, error.remedy)
    return SensingLaw(law.name, table.site, quantities)
