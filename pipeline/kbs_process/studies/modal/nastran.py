"""Modes from Nastran's printed results (f06 of a SOL 103): eigenvalues, eigenvectors, forces of constraint.

The finite element model is the article on the transducer's springs: one grid point is the interface (the top plate,
at T's origin, displacement axes those of T), and one or more, at the same place, hold the ground ends of the springs
and what is rigid. In mode k those points pull on the structure with f_k, which is all that accelerates it:
f_k = -w_k^2 P_k gives the participation. Both are divided by the root of the generalised mass.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from kbs_process.campaign.documents import shown
from kbs_process.errors import RecordingError
from kbs_process.files import regular
from kbs_process.plant.linear.modal import ModalModel
from kbs_process.signals.records import Array

_NUMBER = r"[-+]?\d+\.\d*(?:[ED]?[-+]\d+)?"
_EIGENVALUE = re.compile(rf"^0?\s*(\d+)\s+\d+\s+({_NUMBER})\s+({_NUMBER})\s+({_NUMBER})\s+({_NUMBER})\s+{_NUMBER}\s*$")
_POINT = re.compile(rf"^0?\s*(\d+)\s+G\s+({_NUMBER}(?:\s+{_NUMBER}){{5}})\s*$")
_EIGENVALUES, _EIGENVECTOR, _CONSTRAINT = ("REALEIGENVALUES", "REALEIGENVECTOR", "FORCESOFSINGLE-POINTCONSTRAINT")


def read_f06(
    path: Path,
    angle: float,
    *,
    interface: int,
    ground: Sequence[int],
    damping: float,
    damping_sigma: float = 0.0,
    frequency_sigma: float = 0.0,
) -> ModalModel:
    """Return the modes in an f06 file at `angle` (rad) of the table's joint; `damping` of critical is that of all.

    `frequency_sigma` is relative. A free body's modes, below 1e-3 Hz, are left out.
    Raises RecordingError where the file lacks eigenvalues, or rows of the grid points.
    """
    eigenvalues, points = _tables(path)
    if not len(eigenvalues):
        raise RecordingError(
            "no table of real eigenvalues",
            where=shown(path),
            remedy="give the f06 file of a SOL 103 that ran to its end",
        )
    modes = len(eigenvalues)
    root_mass = np.sqrt(eigenvalues[:, 2])
    shape = _rows(points, _EIGENVECTOR, interface, modes, path) / root_mass[:, None]
    forces = sum(_rows(points, _CONSTRAINT, grid, modes, path) for grid in ground) / root_mass[:, None]
    kept = eigenvalues[:, 1] > 1e-3
    frequency = eigenvalues[kept, 1]
    squared = (2.0 * np.pi * frequency[:, None]) ** 2
    full = np.ones_like(frequency)
    return ModalModel(
        angle=angle,
        frequency=frequency,
        frequency_sigma=frequency_sigma * frequency,
        damping=damping * full,
        damping_sigma=damping_sigma * full,
        shape=shape[kept].T,
        participation=(-forces[kept] / squared).T,
        gravity=np.zeros((6, len(frequency))),
    )


def _tables(path: Path) -> tuple[Array, dict[tuple[str, int], list[Array]]]:
    """Return (eigenvalue, Hz, generalised mass) of each mode, and the rows of every grid point, table by table."""
    try:
        text = regular(path).read_text(encoding="latin-1")
    except OSError as error:
        raise RecordingError(
            f"cannot be read: {error.strerror}", where=shown(path), remedy="check the file's name and permissions"
        ) from error
    eigenvalues: dict[int, list[float]] = {}
    points: dict[tuple[str, int], list[Array]] = {}
    heading = ""
    for line in text.splitlines():
        squeezed = line.replace(" ", "")
        for known in (_EIGENVALUES, _EIGENVECTOR, _CONSTRAINT):
            if known in squeezed:
                heading = known
        if heading == _EIGENVALUES and (found := _EIGENVALUE.match(line)):
            eigenvalues[int(found[1])] = [_number(found[2]), _number(found[4]), _number(found[5])]
        elif heading != _EIGENVALUES and (found := _POINT.match(line)):
            row = np.array([_number(word) for word in found[2].split()])
            points.setdefault((heading, int(found[1])), []).append(row)
    return np.array([eigenvalues[mode] for mode in sorted(eigenvalues)]), points


def _rows(points: dict[tuple[str, int], list[Array]], heading: str, grid: int, modes: int, path: Path) -> Array:
    """Return the rows (modes, 6) of one grid point: its k-th row belongs to the k-th mode."""
    found = points.get((heading, grid), [])
    if len(found) != modes:
        what = "eigenvectors" if heading == _EIGENVECTOR else "forces of single-point constraint"
        request = "DISPLACEMENT(PRINT) = ALL" if heading == _EIGENVECTOR else "SPCFORCES(PRINT) = ALL"
        raise RecordingError(
            f"grid point {grid} has {len(found)} rows of {what}, for {modes} modes",
            where=shown(path),
            remedy=f"name another grid point, or ask for them in the case control: {request}",
        )
    return np.array(found)


def _number(word: str) -> float:
    """Read Nastran's numbers, of which some leave out the E: 1.5-3."""
    return float(re.sub(r"(?<=[\d.])D?([-+]\d+)$", r"E\1", word) if "E" not in word else word)
