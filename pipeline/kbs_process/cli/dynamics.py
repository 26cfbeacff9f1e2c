"""The dynamics of a campaign's plant: the stability of its loop, and its modes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from kbs_process.cli.shared import EXISTING_FILE, verb

if TYPE_CHECKING:
    from kbs_process.campaign.config import Campaign
    from kbs_process.results.outcome import Outcome


@verb(
    click.option("--joint", metavar="NAME", help="Joint to sweep [default: the last one]."),
    click.option(
        "--from", "low_deg", type=float, default=-30.0, show_default=True, metavar="DEG", help="Its first angle."
    ),
    click.option(
        "--to", "high_deg", type=float, default=90.0, show_default=True, metavar="DEG", help="Its last angle."
    ),
    click.option("--points", type=click.IntRange(2), default=25, show_default=True, help="Poses."),
    example=("stability campaign/EL089", "stability campaign/EL089 --joint el --from 0 --to 87 --points 30"),
    output="results/NAME-stability",
    pdf=True,
    check="the margins are not kept",
    checksums=False,
)
def stability(campaign: Campaign, **options: Any) -> Outcome:
    """Analyse the stability of CAMPAIGN's pointing loop over a joint's range.

    Margins, poles and sensitivity of the linearised, exactly discretised loop on the elastic transducer, and the gains
    at which simulations of the whole plant begin to oscillate.
    """
    from kbs_process.studies.stability.run import analyse_stability

    return analyse_stability(campaign, **options)


@verb(
    click.argument("file", type=click.Path(path_type=Path, dir_okay=False)),
    click.option("--joint", metavar="NAME", help="Joint over whose angle modes are tabulated [default: the last one]."),
    click.option(
        "--at", "angles", type=float, multiple=True, metavar="DEG", help="Pose to derive modes at; repeatable."
    ),
    click.option(
        "--f06",
        type=(float, EXISTING_FILE),
        multiple=True,
        metavar="DEG FILE",
        help="Nastran results of a pose; repeatable.",
    ),
    click.option("--interface", type=int, help="Grid point of the interface, at T's origin."),
    click.option("--ground", type=int, multiple=True, help="Constrained grid point at the same place; repeatable."),
    click.option("--damping", type=click.FloatRange(0.0, 1.0, True, True), default=0.01, show_default=True),
    example=(
        "modal campaign/EL089 modes.toml --at 70 --at 75 --at 80 --at 87",
        "modal campaign/EL089 modes.toml --f06 70 fem70.f06 --f06 87 fem87.f06 --interface 100 --ground 101",
    ),
    recordings=False,
)
def modal(
    campaign: Campaign,
    file: Path,
    joint: str | None,
    angles: tuple[float, ...],
    f06: tuple[tuple[float, Path], ...],
    interface: int | None,
    ground: tuple[int, ...],
    damping: float,
    **_: Any,
) -> Iterator[str]:
    """Write a modal FILE for CAMPAIGN: derived from its plant, or read from Nastran's f06 files.

    [model] modal in campaign.toml names the file; the report then sends the rigid-base wrench through these modes.
    [mission] mast names one of the unit on its mast, for a reference day.
    """
    if bool(angles) == bool(f06):
        raise click.UsageError("Give --at for modes of the plant, or --f06 for modes of Nastran.")
    if f06 and (interface is None or not ground):
        raise click.UsageError("With --f06, give --interface and --ground.")
    from kbs_process.studies.modal.run import derive_modes, import_modes

    if interface is not None and f06:
        table = import_modes(campaign, joint, f06, file, interface=interface, ground=ground, damping=damping)
    else:
        table = derive_modes(campaign, joint, angles, file)
    for model in table.models:
        frequencies = ", ".join(f"{frequency:.2f}" for frequency in sorted(model.frequency))
        yield f"{table.joint} {math.degrees(model.angle):.1f} deg: {frequencies} Hz"
    yield f"Modes: {file}"
