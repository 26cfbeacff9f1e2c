"""What processing the archived campaigns gave when it was last looked at: `python -m end_to_end.expected`, from tests/.

Processes all of them and writes tests/archive/expected/NAME.json: verdicts, figures of merit, fitted parameters.
Run it after a change that is meant to change results, look at what `git diff` says, and commit both together.
`python -m end_to_end.expected --compare NAME...` processes and only prints how far results are from the files.

Results on one machine are the same to the last bit. On another processor, or with other versions of the libraries,
sums are taken in another order. Forced to other kernels (OPENBLAS_CORETYPE=Prescott, NPY_DISABLE_CPU_FEATURES="X86_V3
X86_V4 AVX512_ICL", NUMBA_CPU_NAME=generic), EL089 moves
    fitted parameters   by up to 1e-6 of their sigma: the fit's iterations end there
    rms and peaks       by up to 2e-7 of themselves, 1e-6 of the channel's uncertainty
    sigmas              by 5e-7 of themselves; those of the requirement by 1e-4, for a joint that rests on the border
                        between two codes of its encoder is rounded up or down by the last digit of its angle
The limits below are some hundred times that, and yet far below what anybody could see in the results.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from end_to_end.archive_run import TESTS, Processed, processed
from engine.campaigns import CAMPAIGNS

EXPECTED_FOLDER = TESTS / "archive" / "expected"
DIGITS = 9

OF_SIGMA = 1e-4  # a fitted value, a judged value, over its stated sigma
OF_VALUE = 1e-4  # an rms or a peak, a fit's sigma, over itself
NOTHING = 1e-9  # N, N m: where rms or peak is a zero but for rounding
OF_JUDGED_SIGMA = 2e-2  # a sigma of the requirement over itself
MERITS = ("measured_rms", "predicted_rms", "residual_rms", "measured_peak", "predicted_peak")
JUDGED = ("value", "sigma", "limit", "channel", "recording", "verdict")


def expected(name: str) -> dict[str, Any]:
    """The committed file of a campaign."""
    return json.loads((EXPECTED_FOLDER / f"{name}.json").read_text())


def extract(campaign: Processed) -> dict[str, Any]:
    """What is kept of a campaign's results."""
    results = campaign.results
    merit: dict[str, dict[str, Any]] = defaultdict(dict)
    for one in results["merit"]:
        row = f"{one['recording']} {one['band']} {one['frame']}"
        merit[row][f"{one['channel']} {one['unit']}"] = [_short(one[key]) for key in MERITS]
    return {
        "verdict": results["verdict"]["status"],
        "requirements": {one["name"]: {key: _short(one[key]) for key in JUDGED} for one in results["requirements"]},
        "parameters": {
            one["name"]: [_short(one["value"]), _short(one["sigma"]), one["unit"]]
            for one in results["gravity"]["parameters"]
        },
        "merit, rms of measured, predicted, residual, peak of measured, predicted": dict(merit),
    }


def differences(found: dict[str, Any], stated: dict[str, Any]) -> Iterator[tuple[str, float]]:
    """Yield what differs, as a multiple of its limit; infinite where no number does."""
    if found["verdict"] != stated["verdict"]:
        yield f"verdict {found['verdict']}, expected {stated['verdict']}", float("inf")
    *_, merit = stated
    for part in ("requirements", "parameters", merit):
        if found[part].keys() != stated[part].keys():
            yield f"{part}: {sorted(found[part].keys() ^ stated[part].keys())}", float("inf")
    for name in found["requirements"].keys() & stated["requirements"].keys():
        one, other = found["requirements"][name], stated["requirements"][name]
        for key in ("limit", "channel", "recording", "verdict"):
            if one[key] != other[key]:
                yield f"{name}: {key} {one[key]}, expected {other[key]}", float("inf")
        yield f"{name}: value", _distance(one["value"], other["value"], OF_SIGMA * other["sigma"])
        yield f"{name}: sigma", _distance(one["sigma"], other["sigma"], OF_JUDGED_SIGMA * other["sigma"])
    for name in found["parameters"].keys() & stated["parameters"].keys():
        one, other = found["parameters"][name], stated["parameters"][name]
        yield f"{name}: value", _distance(one[0], other[0], OF_SIGMA * other[1])
        yield f"{name}: sigma", _distance(one[1], other[1], OF_VALUE * other[1])
    for row in found[merit].keys() & stated[merit].keys():
        for channel in found[merit][row].keys() | stated[merit][row].keys():
            one, other = (side[merit][row].get(channel, [None] * len(MERITS)) for side in (found, stated))
            for key, a, b in zip(MERITS, one, other, strict=True):
                yield f"{row} {channel} {key}", _distance(a, b, OF_VALUE * abs(b or 0.0) + NOTHING)


def write(campaign: Processed) -> None:
    """Write a campaign's file: a line for every recording, band and frame, and for every parameter."""
    EXPECTED_FOLDER.mkdir(exist_ok=True)
    parts = []
    for key, value in extract(campaign).items():
        if isinstance(value, dict):
            lines = ",\n".join(f"  {json.dumps(name)}: {json.dumps(entry)}" for name, entry in value.items())
            parts.append(f" {json.dumps(key)}: {{\n{lines}\n }}")
        else:
            parts.append(f" {json.dumps(key)}: {json.dumps(value)}")
    (EXPECTED_FOLDER / f"{campaign.name}.json").write_text("{\n" + ",\n".join(parts) + "\n}\n")


def _distance(found: float | None, stated: float | None, limit: float) -> float:
    if found is None or stated is None or limit == 0.0:
        return 0.0 if found == stated else float("inf")
    return abs(found - stated) / limit


def _short(value: Any) -> Any:
    return float(f"{value:.{DIGITS}g}") if isinstance(value, float) else value


def main() -> None:
    """Make the files, or compare with them."""
    parser = argparse.ArgumentParser(prog="python -m end_to_end.expected", description=__doc__)
    parser.add_argument("campaign", nargs="*", default=list(CAMPAIGNS))
    parser.add_argument("--compare", action="store_true", help="print the greatest differences, write nothing")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as root:
        for name in arguments.campaign:
            campaign = processed(name, Path(root))
            if arguments.compare:
                worst = sorted(differences(extract(campaign), expected(name)), key=lambda one: one[1], reverse=True)
                for what, distance in worst[:5]:
                    print(f"{name}: {what}: {distance:.2g} of its limit")
            else:
                write(campaign)
                print(f"{name}: {campaign.results['verdict']['sentence']}")


if __name__ == "__main__":
    main()
