"""Stored results whose lists do not fit each other are told as such, and nothing is drawn of them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

from kbs_process.errors import OutputError
from kbs_process.results.records import decode, encode
from kbs_process.studies.correlate.results import CrossCoupling, Results
from kbs_process.studies.diagnose.results import Curve
from kbs_process.studies.identify.results import Correlations, Interval
from report import sample

SIX = ["Fx", "Fy", "Fz", "Tx", "Ty", "Tz"]
WHOLE = [[0.0] * 6] * 6
OVER = {"regressor": "angle", "x_unit": "rad", "y_unit": "N m"}


@pytest.mark.parametrize(
    ("record", "told"),
    [
        (CrossCoupling, {"channels": SIX, "matrix": [[0.0]], "sigma": WHOLE, "largest": ""}),
        (CrossCoupling, {"channels": SIX, "matrix": WHOLE, "sigma": [[0.0] * 5] * 6, "largest": ""}),
        (Curve, OVER | {"x": [0.0, 1.0], "y": [0.0, 1.0], "sigma": [0.1]}),
        (Curve, OVER | {"x": [0.0, 1.0], "y": [0.0, 1.0], "sigma": [0.1, 0.1], "fitted": [1.0]}),
        (Interval, {"low": 0.0, "high": 1.0, "x": [0.0], "D": []}),
        (Correlations, {"names": ["a", "b"], "matrix": [[1.0, 0.0]]}),
    ],
)
def test_lists_that_belong_together_are_as_long_as_each_other(record: type[Any], told: dict[str, Any]) -> None:
    with pytest.raises(msgspec.ValidationError, match="lists that belong together have"):
        msgspec.convert(told, record)


def test_numbers_of_numpy_are_numbers() -> None:
    one = Curve(x=(np.float64(1.5),), y=(np.float32(2.5),), sigma=(0.1,), **OVER)
    assert msgspec.json.decode(encode(one))["y"] == [2.5]


@pytest.mark.parametrize("value", [1e308, -(10**400)])
def test_a_number_that_nothing_computes_is_told_with_its_place(tmp_path: Path, value: float) -> None:
    stored = msgspec.json.decode((sample.one_channel(tmp_path / "out") / "results.json").read_bytes())
    stored["recordings"][0]["clocks"][0]["skew"] = value
    with pytest.raises(OutputError, match=r"no result is beyond 1e\+150.*recordings\[0\]\.clocks\[0\]\.skew"):
        decode(json.dumps(stored).encode(), Results)


def test_a_sigma_below_zero_is_told() -> None:
    with pytest.raises(OutputError, match=r"no sigma is negative - at `\$\.a\[0\]\.sigma`"):
        decode(b'{"schema": 1, "a": [{"sigma": -1}]}', Results)


def test_a_matrix_that_is_too_small_is_no_fault_of_the_program(tmp_path: Path) -> None:
    stored = msgspec.json.decode((sample.one_channel(tmp_path / "out") / "results.json").read_bytes())
    stored["cross_coupling"] = {"channels": SIX, "matrix": [[0.0]], "sigma": [[0.1]], "largest": "none"}
    with pytest.raises(OutputError, match=r"1 and 6 entries.*cross_coupling") as caught:
        decode(msgspec.json.encode(stored), Results)
    assert "process the campaign again" in caught.value.remedy
