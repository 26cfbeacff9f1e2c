"""Let rivals answer: `python -m proof.rivals CAMPAIGN FOLDER METHOD...` writes FOLDER/METHOD.json for each."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

from proof.answer import Answer, write
from proof.rivals import boosting, gaussian, greybox, parameters, smoother, sparse
from proof.rivals.case import Case
from proof.rivals.prepare import prepare

RIVALS: dict[str, Callable[[Case], Answer]] = {
    "parameters": parameters.solve,
    "sparse": sparse.solve,
    "gaussian process": gaussian.solve,
    "boosting": boosting.solve,
    "grey box": greybox.solve,
}


def main() -> None:
    """Prepare once, as all rivals but one begin alike; each one's time counts that."""
    campaign, folder, *methods = sys.argv[1:]
    if smoother.METHOD in methods:
        write(Path(folder) / f"{smoother.METHOD}.json", smoother.solve(Path(campaign)))
    others = [method for method in methods if method != smoother.METHOD]
    case = prepare(Path(campaign)) if others else None
    for method in others:
        assert case is not None
        write(Path(folder) / f"{method}.json", RIVALS[method](case))


if __name__ == "__main__":
    main()
