"""What a change of the diagnosis gains on the benchmark of record, trial by trial; from tests/:

python -m proof.paired BEFORE AFTER     # score.json of each, of the same trials
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import msgspec
from scipy.stats import binomtest

from proof.score import LESS_IS_BETTER, SHARES, Bench, Trial, match


def paired(before: Bench, after: Bench) -> list[str]:
    """Lines of a table: each share on trials that both answered, what was won and lost, the sign test's p-value."""
    sides = [_trials(bench) for bench in (before, after)]
    common = sorted(sides[0].keys() & sides[1].keys())
    lines = [f"{len(common)} trials", f"{'':40} {'before':>7} {'after':>7} {'of':>4} {'won':>4} {'lost':>5} {'p':>6}"]
    for metric, tally in SHARES.items():
        pairs: list[tuple[bool, bool]] = []
        for name in common:
            were, are = ([bool(one) for one in tally(side[name])] for side in sides)
            if len(were) == len(are):  # else they are of what one alone has said
                pairs += zip(were, are, strict=True)
        if not pairs:
            continue
        won, lost = (sum(later - earlier == sign for earlier, later in pairs) for sign in (1, -1))
        if metric in LESS_IS_BETTER:
            won, lost = lost, won
        p = binomtest(won, won + lost).pvalue if won + lost else 1.0
        first, second = (sum(side) for side in zip(*pairs, strict=True))
        lines.append(f"{metric:40} {first:7} {second:7} {len(pairs):4} {won:4} {lost:5} {p:6.2g}")
    ratios = [math.log(sides[1][name].answer.seconds / sides[0][name].answer.seconds) for name in common]
    if ratios:
        lines.append(f"time: {math.exp(sum(ratios) / len(ratios)):.2f} of what it was (geometric mean)")
    return lines


def _trials(bench: Bench) -> dict[str, Trial]:
    answered = zip(bench.truths, bench.answers, strict=True)
    return {truth.trial: Trial(truth, said, match(said, truth.effects)) for truth, said in answered}


def main() -> None:
    """Compare two scores."""
    options = argparse.ArgumentParser(prog="python -m proof.paired", description=__doc__)
    options.add_argument("before", type=Path)
    options.add_argument("after", type=Path)
    asked = options.parse_args()
    before, after = (msgspec.json.decode(path.read_bytes(), type=Bench) for path in (asked.before, asked.after))
    print("\n".join(paired(before, after)))


if __name__ == "__main__":
    main()
