"""What an engineer calls in a notebook: the verbs of the command line as functions, and their results as objects.

They print nothing, and show how far they are only if asked to. What they compute is what the commands compute.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from kbs_process.campaign import load
from kbs_process.campaign.config import Campaign
from kbs_process.campaign.locate import find_campaign, results_folder
from kbs_process.errors import ConfigError, KbsError, OutputError, did_you_mean
from kbs_process.progress import Progress, SilentProgress, progress_for_terminal
from kbs_process.results.records import Record, kind_of
from kbs_process.results.records import load as load_results
from kbs_process.results.tables import read_table

if TYPE_CHECKING:
    from pandas import DataFrame

__all__ = [
    "Campaign",
    "KbsError",
    "Results",
    "diagnose",
    "identify",
    "load_campaign",
    "predict",
    "process",
    "read_table",
    "simulate",
]


def load_campaign(name: str | Path, *, checksums: bool = True, recordings: bool = True) -> Campaign:
    """Read and check a campaign: a folder with a campaign.toml, or `campaign/NAME` for campaigns/NAME here or above.

    >>> campaign = kbs_process.load_campaign("campaign/EL089")
    >>> campaign.rig.joint_names, [entry.name for entry in campaign.recordings]

    Without `checksums`, recordings are not read through to compare their SHA-256. Without `recordings`, there need be
    none: for `simulate` before a test, or `predict` with a corrected model. Raises KbsError, which names the place and
    the remedy of every fault.
    """
    return load.load_campaign(find_campaign(str(name)), checksums=checksums, recordings=recordings)


class Results:
    """The results of any verb, as a folder holds them; the keys of results.json are attributes.

    >>> results = kbs_process.Results("results/EL089")
    >>> results.verdict.sentence, [requirement.margin for requirement in results.requirements]
    """

    def __init__(self, folder: str | Path) -> None:
        from kbs_process.studies.documents import DOCUMENTS

        self.folder = Path(folder)
        self.kind = kind_of(self.folder)
        if self.kind not in DOCUMENTS:
            raise OutputError(
                f"unknown kind '{self.kind}'", where=str(folder), remedy=did_you_mean(self.kind, DOCUMENTS)
            )
        self.record: Record = load_results(self.folder, DOCUMENTS[self.kind].record)

    def __getattr__(self, name: str) -> Any:
        if name == "record":  # not there yet: a copy being made
            raise AttributeError(name)
        return getattr(self.record, name)

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *self.record.__struct_fields__})

    def __repr__(self) -> str:
        return f"Results({str(self.folder)!r}): {self.verdict.sentence}"

    @property
    def report(self) -> Path:
        """The page to open in a browser."""
        return self.folder / "index.html"

    @property
    def tables(self) -> tuple[str, ...]:
        """Every table by its name, such as "bands/EL089P00_1.lt1Hz"."""
        root = self.folder / "tables"
        return tuple(sorted(path.relative_to(root).with_suffix("").as_posix() for path in root.rglob("*.parquet")))

    def table(self, kind: str, recording: str = "", band: str = "") -> DataFrame:
        """Return one table: `kind` is the first part of its name, or the whole of it.

        >>> frame = results.table("bands", "EL089P00_2", "lt1Hz")
        >>> frame["Tx.measured"].plot(ylabel=frame.attrs["units"]["Tx.measured"])

        Its rows are times (s) or frequencies (Hz). `attrs` has the columns' "units", the "frame" of wrenches ("T" or
        "S") and the "history" of the signals.
        """
        parts = ".".join(part for part in (recording, band) if part)
        name = f"{kind}/{parts}" if parts else kind
        if name not in self.tables:
            raise OutputError(f"no table '{name}'", where=str(self.folder), remedy=did_you_mean(name, self.tables))
        return read_table(self.folder / "tables" / f"{name}.parquet")


def process(
    campaign: Campaign | str | Path,
    target: str | Path | None = None,
    *,
    pdf: bool | None = False,
    show_progress: bool = False,
) -> Results:
    """Fit gravity, predict, compare and judge the recordings of a campaign; the results also go to the folder `target`.

    >>> results = kbs_process.process("campaign/EL089", "/tmp/EL089")
    >>> results.verdict.status, results.table("bands", "EL089P00_2", "lt1Hz")

    `target` is the command's where none is given: results/NAME beside campaigns/. With `pdf`, the report is printed as
    well; None prints it if that is possible.
    """
    from kbs_process.studies.correlate.run import process as run

    loaded, folder = _prepared(campaign, target, "")
    run(loaded, folder, progress=_progress(show_progress), pdf=pdf)
    return Results(folder)


def identify(
    campaign: Campaign | str | Path,
    target: str | Path | None = None,
    *,
    starts: int = 2,
    run_to_run: float = 0.02,
    pdf: bool | None = False,
    show_progress: bool = False,
) -> Results:
    """Identify the motor-gears of a campaign from its recordings with the role "fit"; takes ten minutes or more.

    >>> results = kbs_process.identify("campaign/DUMMY1", show_progress=True)
    >>> results.folder / "identified" / "parameters"

    `starts` points are followed; friction torques differ by `run_to_run` of themselves from run to run, one sigma.
    """
    from kbs_process.identification.estimate import Settings
    from kbs_process.studies.identify.run import identify as run

    loaded, folder = _prepared(campaign, target, "-identify")
    settings = Settings(starts=starts, run_to_run=run_to_run)
    run(loaded, folder, settings=settings, progress=_progress(show_progress), pdf=pdf)
    return Results(folder)


def diagnose(
    campaign: Campaign | str | Path,
    target: str | Path | None = None,
    *,
    pdf: bool | None = False,
    show_progress: bool = False,
) -> Results:
    """Find out why recordings differ from their prediction; takes minutes, and is experimental.

    >>> results = kbs_process.diagnose("campaign/EL089", show_progress=True)
    >>> print(results.paragraph)
    """
    from kbs_process.studies.diagnose.run import diagnose as run

    loaded, folder = _prepared(campaign, target, "-diagnosis")
    run(loaded, folder, progress=_progress(show_progress), pdf=pdf)
    return Results(folder)


def predict(
    campaign: Campaign | str | Path,
    recording: str | Path,
    target: str | Path | None = None,
    *,
    show_progress: bool = False,
) -> dict[str, DataFrame]:
    """Predict one recording, by its name or the path of an MCAP file; return a table for each stream.

    >>> predicted = kbs_process.predict("campaign/EL089", "EL089P00_2")
    >>> predicted["wrench"]["Tx"].plot()

    The plant follows what was recorded, with the numbers of the parameter files: nothing is fitted. Only if `target` is
    given, the prediction is kept in that folder, as Parquet and MCAP.
    """
    from kbs_process.studies.predict.run import predict_recording

    loaded = _loaded(campaign)
    progress = _progress(show_progress)
    return _streams(loaded, target, lambda folder: predict_recording(loaded, str(recording), folder, progress=progress))


def simulate(
    campaign: Campaign | str | Path,
    trajectory: str | None = None,
    target: str | Path | None = None,
    *,
    commands: DataFrame | str | Path | None = None,
    rate_Hz: float | None = None,
    stop: float = math.inf,
    show_progress: bool = False,
) -> dict[str, DataFrame]:
    """Run a campaign's plant on commands alone, through its controller; return a table for each stream.

    >>> simulated = kbs_process.simulate("campaign/EL089", "EL089P00")
    >>> simulated = kbs_process.simulate("campaign/EL089", commands=frame)  # columns t (s), az (rad), el (rad)

    The commands are those recorded in the first run of `trajectory` (by default the last one listed), or those of a
    table, or of a CSV or Parquet file. The wrench comes at `rate_Hz`: by default at the recording's rate, and for a
    table at 100 Hz. A stop is requested at `stop`, s. Only if `target` is given, the simulation is kept in that folder.
    """
    from kbs_process.studies.predict.run import simulate_commands, simulate_trajectory

    if trajectory is not None and commands is not None:
        raise ConfigError("both a trajectory and commands are given", remedy="give one of them")
    loaded = _loaded(campaign, recordings=commands is None)
    how: dict[str, Any] = {"progress": _progress(show_progress), "stop": stop}
    if commands is None:
        return _streams(loaded, target, lambda to: simulate_trajectory(loaded, trajectory, to, rate_Hz=rate_Hz, **how))
    with TemporaryDirectory() as private:
        path = Path(private) / "commands.parquet"
        if isinstance(commands, str | Path):
            path = Path(commands)
        else:
            commands.to_parquet(path)
        return _streams(loaded, target, lambda to: simulate_commands(loaded, path, to, rate_Hz=rate_Hz or 100.0, **how))


def _prepared(campaign: Campaign | str | Path, target: str | Path | None, suffix: str) -> tuple[Campaign, Path]:
    """Return the campaign, loaded, and where its results go."""
    loaded = _loaded(campaign)
    return loaded, results_folder(loaded.folder, None if target is None else Path(target), suffix)


def _loaded(campaign: Campaign | str | Path, *, recordings: bool = True) -> Campaign:
    return campaign if isinstance(campaign, Campaign) else load_campaign(campaign, recordings=recordings)


def _streams(campaign: Campaign, target: str | Path | None, write: Callable[[Path], Path]) -> dict[str, DataFrame]:
    """Have the streams written to `target`, or to a place that goes again, and return them."""
    with TemporaryDirectory() as private:
        folder = results_folder(campaign.folder, Path(private) / "streams" if target is None else Path(target))
        return {path.stem: read_table(path) for path in sorted(write(folder).glob("*.parquet"))}


def _progress(shown: bool) -> Progress:
    return progress_for_terminal() if shown else SilentProgress()
