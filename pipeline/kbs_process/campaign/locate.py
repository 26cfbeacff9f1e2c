"""Which folder a user means, and where its results go."""

from __future__ import annotations

from pathlib import Path, PurePath

from kbs_process.errors import ConfigError, OutputError, did_you_mean

CAMPAIGNS = "campaigns"
RESULTS = "results"
CAMPAIGN_FILE = "campaign.toml"


def find_campaign(name: str) -> Path:
    """Return the folder of a campaign: a path, or `campaign/NAME` for campaigns/NAME here or above.

    Raises ConfigError that lists the campaigns there are.
    """
    path = Path(name)
    if path.is_file() and path.name == CAMPAIGN_FILE:
        return path.absolute().parent
    if path.is_dir() and (path / CAMPAIGN_FILE).is_file():
        return path.absolute()
    parts = PurePath(name).parts
    if len(parts) == 2 and parts[0] in ("campaign", CAMPAIGNS):
        for root in (Path.cwd(), *Path.cwd().parents):
            if (root / CAMPAIGNS / parts[1]).is_dir():
                return root / CAMPAIGNS / parts[1]
    if path.is_dir():
        raise ConfigError(
            f"the folder '{name}' is no campaign: it holds no {CAMPAIGN_FILE}",
            remedy="name the folder that holds it, or campaign/NAME for campaigns/NAME",
        )
    raise ConfigError(f"there is no campaign '{name}'", remedy=_remedy(name))


def _remedy(name: str) -> str:
    known = known_campaigns()
    if not known:
        return "name the folder of a campaign, or work where there is a folder campaigns/"
    return did_you_mean(PurePath(name).name, known, before="campaign/")


def known_campaigns() -> tuple[str, ...]:
    """Return the names in the nearest folder campaigns/, here or above."""
    for root in (Path.cwd(), *Path.cwd().parents):
        if (root / CAMPAIGNS).is_dir():
            return tuple(sorted(path.parent.name for path in (root / CAMPAIGNS).glob(f"*/{CAMPAIGN_FILE}")))
    return ()


def results_folder(campaign: Path, output: Path | None, suffix: str = "") -> Path:
    """Return where results go: X/results/NAME for X/campaigns/NAME, else results/NAME here, or `output`.

    Raises OutputError for a place inside the campaign's own folder, or around it.
    """
    campaign = campaign.absolute()
    if output is not None:
        target = output.absolute()
    elif campaign.parent.name == CAMPAIGNS:
        target = campaign.parents[1] / RESULTS / (campaign.name + suffix)
    else:
        target = Path.cwd() / RESULTS / (campaign.name + suffix)
    inner, outer = target.resolve(), campaign.resolve()
    if inner.is_relative_to(outer) or outer.is_relative_to(inner):
        raise OutputError(
            "results cannot go into the campaign's folder, nor replace a folder that holds it",
            where=str(target),
            remedy="name another folder with --output",
        )
    return target
