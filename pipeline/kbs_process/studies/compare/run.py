"""Read folders of results, however many, and lay side by side what they judge and what they fitted."""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable, Iterable, Sequence
from itertools import combinations
from pathlib import Path
from typing import TypeVar

import msgspec
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

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
from kbs_process.studies.compare.results import Compared, ComparisonResults, Judged, Number, far

SPECTRA = "spectra"  # tables of the deciding channel's density, by the place of the results
SPECTRA_OF = 8  # results, the last ones
_BEYOND_PRIOR = 0.9  # of a prior's sigma, below which recordings say something of a number
_SAYS = Prose("kbs_process.studies.compare", "answer")
_V = TypeVar("_V")


class _Campaign(msgspec.Struct, frozen=True):
    name: str
    title: str
    article: str


class _Document(msgspec.Struct, frozen=True):
    number: str = ""
    revision: str = ""
    date: str = ""


class _Fitted(msgspec.Struct, frozen=True):
    name: str
    unit: str
    value: float
    sigma: float
    prior_sigma: float | None = None


class _Gravity(msgspec.Struct, frozen=True):
    parameters: tuple[_Fitted, ...] = ()
    reduced_chi_square: float | None = None


class _Merit(msgspec.Struct, frozen=True):
    recording: str
    channel: str
    band: str
    frame: str
    residual_rms: float | None = None


class _Model(msgspec.Struct, frozen=True):
    status: str


class _Processed(msgspec.Struct, frozen=True):
    """What is compared of the results of processing."""

    campaign: _Campaign
    verdict: Conclusion
    provenance: Provenance
    document: _Document = _Document()
    model: _Model | None = None
    requirements: tuple[Requirement, ...] = ()
    gravity: _Gravity | None = None
    merit: tuple[_Merit, ...] = ()


def find(folders: Iterable[Path]) -> list[Path]:
    """Return folders of results: those given, and of those that have none, all of processing below them."""
    found: list[Path] = []
    for folder in folders:
        below = [folder] if (folder / FILE).exists() else sorted(filter(_is_of_processing, _below(folder)))
        if not below:
            raise OutputError("no results here, or below", where=str(folder), remedy="kbs-process CAMPAIGN makes them")
        found += below
    return list(dict.fromkeys(found))


def _below(folder: Path) -> list[Path]:
    return [Path(root) for root, _, files in os.walk(folder) if FILE in files]


def _is_of_processing(folder: Path) -> bool:
    try:
        return kind_of(folder) == "correlation"
    except OutputError:  # another program's
        return False


def compare(folders: Sequence[Path], target: Path, pdf: bool | None = None) -> Outcome:
    """Compare the results in `folders`, in the order of their tests' dates, and write a report to `target`."""
    # Dates sort as they are written; results without one come last, in the order in which they are given.
    read = sorted(
        ((folder, _read(folder)) for folder in folders),
        key=lambda one: (not one[1].document.date, one[1].document.date),
    )
    requirements = tuple(_requirements([results for _, results in read]))
    numbers = tuple(sorted(_numbers([results for _, results in read]), key=lambda one: -(one.distance or 0.0)))
    compared = tuple(_compared(_mark(place), folder, results, target) for place, (folder, results) in enumerate(read))
    apart = [one for one in numbers if one.distance is not None and one.distance > far(len(read))]
    told = _SAYS("answer", count=len(read), requirements=requirements, apart=apart, far=far(len(read)))
    results = ComparisonResults(
        verdict=Conclusion(status="none", sentence=told),
        provenance=_made(folders),
        compared=compared,
        requirements=requirements,
        numbers=numbers,
    )
    with writing(target) as folder:
        _keep_spectra(read, requirements, folder)
        _keep_trends(results, folder)
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


def _compared(mark: str, folder: Path, results: _Processed, target: Path) -> Compared:
    page = folder / "index.html"
    return Compared(
        mark=mark,
        folder=str(folder),
        name=results.campaign.name,
        title=results.campaign.title,
        article=results.campaign.article,
        number=results.document.number,
        revision=results.document.revision,
        date=results.document.date,
        made_by=maker(results.provenance),
        status=results.verdict.status,
        sentence=results.verdict.sentence,
        model=results.model.status if results.model else "",
        chi_square=results.gravity.reduced_chi_square if results.gravity else None,
        page=Path(os.path.relpath(page, target)).as_posix() if page.is_file() else "",
    )


def _requirements(read: Sequence[_Processed]) -> list[Judged]:
    """Requirements that are the same in all that is judged: name, statistic, frame, band, limit and unit."""
    found: dict[tuple[object, ...], list[Requirement | None]] = {}
    for place, results in enumerate(read):
        for one in results.requirements:
            same = (one.name, one.statistic, one.frame, one.band_Hz, one.limit, one.unit)
            found.setdefault(same, [None] * len(read))[place] = one
    return [_judged(own, [results.merit for results in read]) for own in found.values()]


def _judged(own: Sequence[Requirement | None], merits: Sequence[Sequence[_Merit]]) -> Judged:
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
        residual=tuple(None if one is None else _left(one, merit) for one, merit in zip(own, merits, strict=True)),
        channel=each(lambda one: one.channel),
        recording=each(lambda one: one.recording),
    )


def _left(one: Requirement, merits: Sequence[_Merit]) -> float | None:
    """What the prediction leaves of the channel that decides."""
    decides = (one.recording, one.channel, one.band, one.frame)
    own = (m.residual_rms for m in merits if (m.recording, m.channel, m.band, m.frame) == decides)
    return next(own, None)


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
            determined=any(one and _says_more(one) for one in own),
        )
        for (name, unit), own in found.items()
    ]


def _says_more(one: _Fitted) -> bool:
    return one.prior_sigma is None or one.sigma < _BEYOND_PRIOR * one.prior_sigma


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
    for place, (source, results) in list(enumerate(read))[-SPECTRA_OF:]:
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


def _keep_trends(results: ComparisonResults, folder: Path) -> None:
    """One table of all requirements and one of all numbers, a row for each in each of the results."""
    about = [
        {"campaign": one.name, "date": one.date, "number": one.number, "revision": one.revision, "folder": one.folder}
        for one in results.compared
    ]
    judged = ("verdict", "value", "low", "high", "predicted", "residual", "channel", "recording")
    tables: dict[str, tuple[tuple[Judged, ...] | tuple[Number, ...], tuple[str, ...], tuple[str, ...]]] = {
        "requirements": (results.requirements, ("name", "statistic", "frame", "band_Hz", "limit", "unit"), judged),
        "numbers": (results.numbers, ("name", "unit"), ("value", "sigma")),
    }
    for name, (entries, same, each) in tables.items():
        rows = [
            where
            | {"model": compared.model}
            | {field: getattr(one, field) for field in same}
            | {field: getattr(one, field)[place] for field in each}
            for one in entries
            for place, (where, compared) in enumerate(zip(about, results.compared, strict=True))
            if one.value[place] is not None
        ]
        if rows:
            path = folder / "tables" / f"{name}.parquet"
            path.parent.mkdir(exist_ok=True)
            pq.write_table(pa.Table.from_pylist(rows), path, compression="zstd")


def _made(folders: Sequence[Path]) -> Provenance:
    files = [folder / FILE for folder in folders]
    command = "kbs-process compare " + " ".join(shlex.quote(str(folder)) for folder in folders)
    return msgspec.structs.replace(provenance.made("compare", Path(), files), command=command)
