"""What results were made from and with; nothing that changes from one run to the next."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Iterable
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

import kbs_process
from kbs_process.errors import RecordingError
from kbs_process.files import regular
from kbs_process.results import code
from kbs_process.results.records import Constant, InputFile, Provenance
from kbs_process.rig.model import Quantity, Rig

# Libraries that compute, read or write; a report names their versions.
LIBRARIES = ("numpy", "scipy", "numba", "pandas", "pyarrow", "mcap", "zstandard", "lz4", "msgspec", "matplotlib")


def sha256(path: Path) -> str:
    """Return the file's SHA-256 in hexadecimal; a file that has not changed is read once."""
    try:
        status = regular(path).stat()
        return _sha256(path, status.st_size, status.st_mtime_ns)
    except OSError as error:
        raise RecordingError(
            f"cannot be read: {error.strerror}", where=str(path), remedy="check the file and its permissions"
        ) from error


@lru_cache(maxsize=4096)
def _sha256(path: Path, size: int, modified_ns: int) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def software() -> dict[str, Any]:
    """Return the versions of everything that computes, and the code's commit or, where that is not all, its SHA-256."""
    return {
        "kbs-process": kbs_process.__version__,
        "commit": code.commit(),
        "source": code.source(),
        "python": platform.python_version(),
        "platform": f"{platform.system()} {platform.machine()}",
        "libraries": {name: _version(name) for name in LIBRARIES},
    }


def made(verb: str, folder: Path, files: Iterable[Path], options: str = "") -> Provenance:
    """Return what made results: the command on the campaign in `folder`, the software, and the files that were read."""
    about = software()
    return Provenance(
        version=about["kbs-process"],
        python=about["python"],
        libraries=about["libraries"],
        platform=about["platform"],
        command=" ".join(part for part in ("kbs-process", verb, _named(folder.absolute()), options) if part),
        commit=about["commit"],
        source=about["source"],
        inputs=tuple(InputFile(file=file, sha256=digest) for file, digest in checksums(folder, files).items()),
    )


def _named(folder: Path) -> str:
    """A campaign as commands name it: an archived one, or the folder's name alone, wherever that is."""
    return f"campaign/{folder.name}" if folder.parent.name == "campaigns" else folder.name


def checksums(folder: Path, files: Iterable[Path]) -> dict[str, str]:
    """Return the SHA-256 of each file by its path, relative to the campaign's folder where it is inside."""
    return {_relative(path, folder): sha256(path) for path in files}


def constants(rig: Rig) -> Iterable[Constant]:
    """Yield every quantity of the rig as a report prints it."""
    for quantity in _sorted(rig):
        yield Constant(
            name=quantity.name,
            value=_text(quantity.value.tolist()),
            unit=quantity.unit,
            sigma=_text(quantity.sigma.tolist()),
            source=quantity.source,
        )


def parameters(rig: Rig) -> list[dict[str, Any]]:
    """Return every quantity of the rig in SI, as it was used."""
    return [
        {
            "name": quantity.name,
            "value": quantity.value.tolist(),
            "unit": quantity.unit,
            "sigma": quantity.sigma.tolist(),
            "source": quantity.source,
        }
        for quantity in _sorted(rig)
    ]


def _sorted(rig: Rig) -> list[Quantity]:
    quantities = rig.quantities()
    return [quantities[name] for name in sorted(quantities)]


def _relative(path: Path, folder: Path) -> str:
    return path.relative_to(folder).as_posix() if path.is_relative_to(folder) else str(path)


def _version(library: str) -> str:
    try:
        return version(library)
    except PackageNotFoundError:
        return "not installed"


def _text(value: float | list[object]) -> float | str:
    return value if isinstance(value, float) else ", ".join(str(x) for x in np.ravel(np.asarray(value)))
