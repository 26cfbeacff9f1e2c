"""Look into recordings, and make a campaign of those in other formats."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from kbs_process.cli.shared import (
    BAD_INPUT,
    EXISTING_FILE,
    FOLDER,
    NOT_MET,
    check_option,
    complain,
    examples,
    json_option,
    progress,
    quiet_option,
    say,
    say_json,
)
from kbs_process.studies.convert import preset_names


@click.command(epilog=examples("init bench --from logs/*.csv", "validate bench"))
@click.argument("folder", type=FOLDER)
@click.option("--from", "given", required=True, type=EXISTING_FILE, metavar="FILE...", help="Recordings of any format.")
@click.argument("more", nargs=-1, type=EXISTING_FILE, metavar="")
def init(folder: Path, given: Path, more: tuple[Path, ...]) -> None:
    """Begin a campaign of a rig of your own: FOLDER with campaign.toml, rig.toml and mapping.toml.

    What the recordings tell is put in, and printed. What only you know is marked "?"; `validate FOLDER` lists it.
    """
    from kbs_process.studies.convert.begin import begin

    say(*begin(folder, (given, *more)))
    say(f"Begun: {folder}", f'  -> put in what is marked "?"; kbs-process validate {folder} lists it')


@click.command(epilog=examples("inspect recording.mcap", "inspect --check campaigns/EL089/recordings/*.mcap"))
@click.argument("files", nargs=-1, required=True, type=EXISTING_FILE, metavar="FILE...")
@check_option("a recording has losses")
@json_option
def inspect(files: tuple[Path, ...], check: bool, as_json: bool) -> None:
    """Show what is in recordings: topics, rates, gaps, ranges, damage.

    Exits with 2 if one of them cannot be read at all.
    """
    from kbs_process.reduction.inspection import inspect_recording
    from kbs_process.studies.validate.listing import describe_inspection

    found = []
    for path in files:
        found.append(inspect_recording(path))
        if not as_json:
            say(*describe_inspection(found[-1]))
    if as_json:
        say_json(found)
    states = {inspection.state for inspection in found}
    if "unreadable" in states:
        sys.exit(BAD_INPUT)
    if check and "lossy" in states:
        sys.exit(NOT_MET)


@click.command(
    "import",
    epilog=examples("import --describe bench.tdms", "import mapping.toml /data/bench campaigns/BENCH")
    + f"\n\nPresets, for public recordings of other rigs: {', '.join(preset_names())}.",
)
@click.argument("mapping", required=False)
@click.argument("source", required=False, type=click.Path(path_type=Path, exists=True))
@click.argument("campaign", required=False, type=FOLDER)
@click.option(
    "--describe", "file", type=EXISTING_FILE, metavar="FILE", help="List the columns of FILE, with their ranges."
)
@quiet_option
def import_(mapping: str | None, source: Path | None, campaign: Path | None, file: Path | None, quiet: bool) -> None:
    """Convert CSV, Parquet, HDF5, TDMS, MDF4, MATLAB or NumPy files in SOURCE into a new folder CAMPAIGN.

    MAPPING is a TOML file that says which columns are which channels, or the name of a preset.
    """
    if file is not None:
        from kbs_process.studies.convert.describe import describe

        click.echo(describe(file), nl=False)
        return
    if mapping is None or source is None or campaign is None:
        raise click.UsageError(
            f"Give MAPPING, SOURCE and CAMPAIGN, or --describe FILE. Presets: {', '.join(preset_names())}"
        )
    from kbs_process.studies.convert.run import import_recordings

    made = import_recordings(mapping, source, campaign, progress=progress(quiet), notice=complain)
    say(f"Campaign: {made}")


@click.command(epilog=examples("schema campaign > campaign.schema.json", "schema correlation > results.schema.json"))
@click.argument("name")
def schema(name: str) -> None:
    """Print the JSON Schema of a kind of files, such as campaign, parameters or import, for editors and programs."""
    from kbs_process.studies.schemas import schema_text

    click.echo(schema_text(name), nl=False)
