"""Compile the generated plant once and keep it in the user's cache, across processes and versions."""

from __future__ import annotations

import hashlib
import importlib.util
import inspect
import os
import sys
import tempfile
import threading
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any, cast

import numba

from kbs_process.cache import cache_folder
from kbs_process.plant.compiled import elementary, kernels
from kbs_process.plant.compiled.generate import module_text
from kbs_process.plant.compiled.lanes import lanes_text
from kbs_process.plant.structure import Structure

_ONE_AT_A_TIME = threading.Lock()


@dataclass(frozen=True, slots=True)
class Compiled:
    """The entries of a generated module; see its text at `path`."""

    path: Path
    balance: Callable[..., Any]
    advance: Callable[..., Any]
    tap: Callable[..., Any]


@cache
def compiled_plant(structure: Structure) -> Compiled:
    """Return the compiled plant of `structure`, from this process, from the cache, or made now."""
    module = _plant(structure)
    return Compiled(Path(str(module.__file__)), module.balance, module.advance, module.tap)


@cache
def compiled_lanes(structure: Structure) -> Callable[..., Any]:
    """Return the time loop of several plants of `structure` side by side, likewise."""
    return cast(Callable[..., Any], _plant(structure).advance_lanes)


def _plant(structure: Structure) -> ModuleType:
    """One module for a plant alone and for several: what both call is compiled once, when it is called first."""
    effects = [*structure.effects, *(load.effect for load in structure.loads)]
    called = [inspect.getmodule(effect.equation) for effect in effects]
    return compiled_module("plant", f"{module_text(structure)}\n\n{lanes_text(structure)}", called)


def compiled_module(kind: str, text: str, modules: Iterable[ModuleType | None]) -> ModuleType:
    """Import `text` as a module, kept in the cache; `modules` are those whose functions it calls."""
    name = f"{kind}_{_fingerprint(text, modules)}"
    with _ONE_AT_A_TIME:  # or each thread would compile its own
        if name in sys.modules:
            return sys.modules[name]
        path = _written(name, text)
        spec = importlib.util.spec_from_file_location(name, path)
        if spec is None or spec.loader is None:
            raise ImportError(f"no loader for {path}")
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        sys.modules[name] = module
        return module


def _fingerprint(text: str, called: Iterable[ModuleType | None]) -> str:
    """Hash everything that decides the machine code: numba does not notice edits in imported files."""
    modules = [elementary, kernels, *(module for module in called if module is not None)]
    sources = [inspect.getsource(module) for module in modules]
    parts = [text, *sources, numba.__version__, sys.version]
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:24]


def _written(name: str, text: str) -> Path:
    """Return the file with `text`, writing it aside and renaming, so that processes may race."""
    try:
        return _write(cache_folder(), name, text)
    except OSError:  # a read-only home: compile for this process alone
        return _write(_process_folder(), name, text)


@cache
def _process_folder() -> Path:
    folder = tempfile.TemporaryDirectory(prefix="kbs-process-")
    _KEPT.append(folder)  # removed when the interpreter ends
    return Path(folder.name)


_KEPT: list[tempfile.TemporaryDirectory[str]] = []


def _write(folder: Path, name: str, text: str) -> Path:
    path = folder / f"{name}.py"
    folder.mkdir(parents=True, exist_ok=True)
    if not os.access(folder, os.W_OK):
        raise PermissionError(f"{folder} cannot be written, and machine code belongs beside its source")
    if path.is_file() and path.read_bytes() == text.encode():
        return path  # a new time of modification would void the machine code beside it
    handle, aside = tempfile.mkstemp(dir=folder, prefix=name, suffix=".tmp")
    with os.fdopen(handle, "w", encoding="utf-8") as file:
        file.write(text)
    Path(aside).replace(path)
    return path
