"""Read several folders of results, and lay side by side what they judge and what they fitted."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Sequence
from itertools import combinations
from pathlib import Path
from typing import TypeVar

import msgspec
import numpy as np

from kbs_process.errors import OutputError
from kbs_process.report.build import publish
from kbs_process.report.prose import Prose
from kbs_process.report.provenance import maker
from kbs_process.results import provenance
from kbs_process.results.judged import Requirement
from kbs_process.results.outcome import Outcome
from kbs_process.results.records import FILE, Conclusion, Provenance, kind_of, load
from kbs_process.results.store import check_unchanged, writing
from kbs_process.results.tables import read_columns, write_table
from kbs_process.signals.records import Array
from kbs_process.studies.compare.results import FAR, Compared, ComparisonResults, Judged, Number

SPECTRA = "spectra"  # tables of the deciding channel's density, by the place of the results
_SAYS = Prose("kbs_process.studies.compare", "answer")
_V = TypeVar("_V")


class _Campaign(msgspec.Struct, frozen=True):
    name: str
    title: str
    article: str


class _Dated(msgspec.Struct, frozen=True):
    date: str = ""


class _Fitted(msgspec.Struct, frozen=True):
    name: str
    unit: str
    value: float
    sigma: float


class _Gravity(msgspec.Struct, frozen=True):
    parameters: tuple[_Fitted, ...] = ()


class _Model(msgspec.Struct, frozen=True):
    status: str


class _Processed(msgspec.Struct, frozen=True):
    """What is compared of the results of processing."""

    campaign: _Campaign
    verdict: Conclusion
    provenance: Provenance
    document: _Dated = _Dated()
    model: _Model | None = None
    requirements: tuple[Requirement, ...] = ()
    gravity: _Gravity | None = None


def compare(folders: Sequence[Path], target: Path, pdf: bool | None = None) -> Outcome:
    """Compare the results in `folders`, in the order of their tests' dates, and write a report to `target`."""
    # Dates sort as they are written; results without one come last, in the order in which they are given.
    read = sorted(
        ((folder, _read(folder)) for folder in folders),
        key=lambda one: (not one[1].document.date, one[1].document.date),
    )
    requirements = tuple(_requirements([results for _, results in read]))
    numbers = tuple(sorted(_numbers([results for _, results in read]), key=lambda one: -(one.distance or 0.0)))
    compared = tuple(_compared(_mark(place), folder, results) for place, (folder, results) in enumerate(read))
    apart = [one for one in numbers if one.distance is not None and one.distance > FAR]
    told = _SAYS("answer", count=len(read), requirements=requirements, apart=apart, far=FAR)
    results = ComparisonResults(
        verdict=Conclusion(status="none", sentence=told),
        provenance=_made(folders),
        compared=compared,
        requirements=requirements,
        numbers=numbers,
    )
    with writing(target) as folder:
        _keep_spectra(read, requirements, folder)
        from kbs_process.studies.compare.report import DOCUMENT  # draws: takes its time to import

        return publish(folder, target, results, DOCUMENT, pdf)


def _read(folder: Path) -> _Processed:
    check_unchanged(folder)
    if (kind := kind_of(folder)) != "correlation":
        raise OutputError(
            f"holds results of kind '{kind}'",
            where=str(folder / FILE),
            remedy="compare results of processing: kbs-process CAMPAIGN makes them",
        )
    return load(folder, _Processed)


def _mark(place: int) -> str:
    """A, B, ... Z, A2, ..."""
    return chr(ord("A") + place % 26) + ("" if place < 26 else str(place // 26 + 1))


def _compared(mark: str, folder: Path, results: _Processed) -> Compared:
    return Compared(
        mark=mark,
        folder=str(folder),
        name=results.campaign.name,
        title=results.campaign.title,
        article=results.campaign.article,
        date=results.document.date,
        made_by=maker(results.provenance),
        status=results.verdict.status,
        sentence=results.verdict.sentence,
        model=results.model.status if results.model else "",
    )


def _requirements(read: Sequence[_Processed]) -> list[Judged]:
    """Requirements that are the same in all that is judged: name, statistic, frame, band, limit and unit."""
    found: dict[tuple[object, ...], list[Requirement | None]] = {}
    for place, results in enumerate(read):
        for one in results.requirements:
            same = (one.name, one.statistic, one.frame, one.band_Hz, one.limit, one.unit)
            found.setdefault(same, [None] * len(read))[place] = one
    return [_judged(own) for own in found.values()]


def _judged(own: Sequence[Requirement | None]) -> Judged:
    first = next(one for one in own if one is not None)

    def each(of: Callable[[Requirement], _V]) -> tuple[_V | None, ...]:
        return tuple(None if one is None else of(one) for one in own)

    return Judged(
        name=first.name,
        statistic=first.statistic,
        frame=first.frame,
        band_Hz=first.band_Hz,
        limit=first.limit,
        unit=first.unit,
        verdict=each(lambda one: one.verdict),
        value=each(lambda one: one.value),
        low=each(lambda one: one.low),
        high=each(lambda one: one.high),
        predicted=each(lambda one: one.predicted_value),
        channel=each(lambda one: one.channel),
        recording=each(lambda one: one.recording),
    )


def _numbers(read: Sequence[_Processed]) -> list[Number]:
    found: dict[tuple[str, str], list[_Fitted | None]] = {}
    for place, results in enumerate(read):
        for one in results.gravity.parameters if results.gravity else ():
            found.setdefault((one.name, one.unit), [None] * len(read))[place] = one
    return [
        Number(
            name=name,
            unit=unit,
            value=tuple(None if one is None else one.value for one in own),
            sigma=tuple(None if one is None else one.sigma for one in own),
            distance=_distance([one for one in own if one is not None]),
        )
        for (name, unit), own in found.items()
    ]


def _distance(own: Sequence[_Fitted]) -> float | None:
    """Greatest difference of two, over the root of the sum of their variances.

    Validity: fits of different recordings. Those that share recordings, or priors, differ by less than this expects.
    """
    apart = [
        abs(one.value - other.value) / sigma
        for one, other in combinations(own, 2)
        if (sigma := float(np.hypot(one.sigma, other.sigma))) > 0.0
    ]
    return max(apart, default=None)


def _keep_spectra(read: Sequence[tuple[Path, _Processed]], requirements: Sequence[Judged], folder: Path) -> None:
    """Of each requirement, the measured and predicted density of the channel that decides, by results."""
    for place, (source, results) in enumerate(read):
        columns: dict[str, Array] = {}
        units: dict[str, str] = {}
        for number, one in enumerate(requirements):
            path = source / "tables" / "spectrum" / f"{one.recording[place]}.parquet"
            if not path.is_file():
                continue
            content, about = read_columns(path)
            for side in ("measured", "predicted"):
                if (name := f"{one.channel[place]}.{side}") in content.column_names:
                    columns |= {
                        f"{number}.{side}.f": np.asarray(content["f"]),
                        f"{number}.{side}": np.asarray(content[name]),
                    }
                    units |= {f"{number}.{side}.f": "Hz", f"{number}.{side}": about.get("units", {}).get(name, "")}
        if columns:
            path = folder / "tables" / SPECTRA / f"{place}.parquet"
            write_table(path, columns, units, frame="T", recording=results.campaign.name)


def _made(folders: Sequence[Path]) -> Provenance:
    files = [folder / FILE for folder in folders]
    command = "kbs-process compare " + " ".join(shlex.quote(str(folder)) for folder in folders)
    return msgspec.structs.replace(provenance.made("compare", Path(), files), command=command)
