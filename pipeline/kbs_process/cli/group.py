"""The command itself; its verbs are all commands in the files beside."""

from __future__ import annotations

from pathlib import Path

import click

from kbs_process import __version__
from kbs_process.cli import correction, dynamics, flight, prediction, processing, recordings
from kbs_process.cli.shared import examples
from kbs_process.errors import did_you_mean

_FILES = (correction, dynamics, flight, prediction, processing, recordings)


class CampaignGroup(click.Group):
    """A group of verbs; where the first word is none of them, it is a campaign to be processed."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        if args and args[0] == "help" and not Path("help").exists():
            verbs = [word for word in args[1:2] if word in self.commands]
            args = [*verbs, "--help"]
        if args and args[0] not in self.commands and args[0] not in ("--help", "-h", "--version"):
            self._refuse_misspelt_verb(args[0], ctx)
            args = ["process", *args]
        return super().parse_args(ctx, args)

    def _refuse_misspelt_verb(self, word: str, ctx: click.Context) -> None:
        hint = did_you_mean(word, self.commands)
        if hint.startswith("did") and not Path(word).exists():
            raise click.UsageError(f"There is no verb '{word}': {hint}", ctx)


@click.group(
    cls=CampaignGroup,
    commands=[verb for file in _FILES for verb in vars(file).values() if isinstance(verb, click.Command)],
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog=examples("campaign/EL089", "campaign/EL089 --check", "validate campaign/EL089", "VERB --help")
    + "\n\nExit status: 0 done; 1 a requirement is not met or undecided, a recording has losses, or (validate) the "
    "model of the rig is wrong (only with --check); 2 bad input; 70 a fault of kbs-process; 130 interrupted. With "
    "--debug, any error shows its traceback.\n\nEnvironment: stages are kept in a cache folder, and not computed again "
    "from the same inputs. KBS_CACHE=FOLDER is that folder; KBS_CACHE_MB=2000 is its limit, KBS_CACHE_MB=0 keeps none.",
    subcommand_metavar="CAMPAIGN | VERB ...",
)
@click.version_option(__version__, prog_name="kbs-process")
def cli() -> None:
    """Disturbance torque of a pointing mechanism: from raw force/torque recordings to a correlation report.

    Without a verb, CAMPAIGN is processed. campaign/NAME is the folder campaigns/NAME, here or above; any other
    folder that holds a campaign.toml goes as well.
    """
