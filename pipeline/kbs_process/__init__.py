"""From raw force/torque recordings of a pointing mechanism to a correlation report.

In a notebook, everything is a function of this package: docs/notebook.ipynb shows how. They are in `api`, and
loaded when the first of them is used.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

__all__ = [
    "KbsError",
    "Results",
    "__version__",
    "diagnose",
    "identify",
    "load_campaign",
    "predict",
    "process",
    "read_table",
    "simulate",
]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module("kbs_process.api"), name)


def __dir__() -> list[str]:
    return __all__
