"""The chain of links, from the laboratory outwards: lab -> T -> az -> el."""

from __future__ import annotations

from collections.abc import Mapping

from kbs_process.campaign.documents import Key, Merged
from kbs_process.campaign.problems import Problems
from kbs_process.errors import did_you_mean
from kbs_process.rig.model import LAB, TRANSDUCER


def order(joints: Mapping[str, str], transducer_on: str | None, tables: Merged, problems: Problems) -> tuple[str, ...]:
    """Return the joints, given with their parents, from the laboratory outwards; there may be no transducer.

    Notes a parent that does not exist, two links on one parent, and links that do not lead to the laboratory.
    """
    parents = dict(joints)
    if transducer_on is not None:
        parents[TRANSDUCER] = transducer_on
    places: dict[str, Key] = {name: ("joint", name, "parent") for name in joints}
    places[TRANSDUCER] = ("transducer", "on")

    for reserved in {LAB, TRANSDUCER} & set(joints):
        problems.add(tables.place(("joint", reserved)), f"'{reserved}' is a reserved name", "rename the joint")
    children: dict[str, str] = {}
    for link, parent in parents.items():
        place = tables.place(places[link])
        known = {LAB, *parents} - {link}
        if parent not in known:
            problems.add(place, f"'{parent}' is no other link", did_you_mean(parent, known))
        elif parent in children:
            problems.add(
                place,
                f"'{parent}' carries '{children[parent]}' already: the links must form one chain",
                f"mount '{link}' on the last link of the chain, or '{children[parent]}' on '{link}'",
            )
        else:
            children[parent] = link

    chain: list[str] = []
    link = LAB
    while link in children:
        link = children[link]
        chain.append(link)
    for link in parents.keys() - set(chain) if not problems.found else ():
        problems.add(
            tables.place(places[link]),
            f"'{link}' is not connected to the laboratory",
            f"let one link be mounted on '{LAB}' (transducer.on = \"{LAB}\", or a joint's parent)",
        )
    if len(chain) != len(parents):
        return tuple(joints)
    return tuple(link for link in chain if link != TRANSDUCER)
