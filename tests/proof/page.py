"""The score as one self-contained page, in the look of all reports."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure as Sheet

import kbs_process
from kbs_process.report import draw, page
from kbs_process.report.panel import Block, Caption, Cell, Figure, Fold, Grid, Head, Panel, Picture, Text, Tone
from kbs_process.report.text import MISSING, count, number, percent
from kbs_process.results.records import Conclusion
from proof.aims import AIMS, Aim, Reached, beaten, find, reached
from proof.answer import Answer, Suspect
from proof.score import ALL, MEDIANS, SHARES, STRONG, Bench, Row
from proof.truth import Truth
from proof.words import NULLS, OURS, RIVALS

_TONES: dict[Reached, Tone] = {"reached": "pass", "missed": "fail", "not tried": "muted"}
_DRAWN = ("mismatch detected", "place", "physics")
_CAPTION = Caption(
    shown="Share of trials against the strength of what is concealed: detected, put at the right "
    "port, axis and channel, and named rightly (the last two: single effects of the catalogue). Bars are exact "
    "binomial intervals of 95 %. The clairvoyant detector, which knows the waveform, detects nine in ten from a "
    "strength of 4.4 on, at a false alarm rate of 0.001.",
    good="Curves near one from the weakest strength on.",
    bad="Detected early, and named late or never: the mismatch is seen and not understood.",
    do="See the table of trials for what was claimed in place of the truth.",
)


def write_page(bench: Bench, path: Path) -> None:
    """Write the page of a bench."""
    met = [reached(aim, find(bench.rows, OURS, aim.metric, aim.group)) for aim in AIMS]
    missed, tried = met.count("missed"), len(met) - met.count("not tried")
    conclusion = Conclusion(
        status="none" if not tried else "fail" if missed else "pass",
        sentence=f"{tried - missed} of {count(tried, 'aim')} that these trials try are reached"
        + (f", {count(len(met) - tried, 'is', 'are')} not tried." if tried < len(met) else "."),
    )
    nulls = sum(truth.kind in NULLS for truth in bench.truths)
    about = f"{count(len(bench.truths), 'trial')}, {nulls} of them without a concealed effect · {bench.split} set"
    head = Head("Proof bench", bench.split, "Concealed effects", about, conclusion, kbs_process.__version__)
    path.write_text(page.render(head, _panels(bench), "screen"), encoding="utf-8")


def _panels(bench: Bench) -> tuple[Panel, ...]:
    methods = tuple(dict.fromkeys(row.method for row in bench.rows))
    return (
        Panel("aims", "Aims", "What should be reached, and what is?", (_aims(bench.rows),)),
        Panel(
            "strength",
            "Against strength",
            "How strong must an effect be to be found, placed and named?",
            (Figure("Found, placed, named", (_curves(bench.rows, methods),), _CAPTION),),
        ),
        Panel("score", "Score", "How do the methods compare?", _scores(bench.rows, methods)),
        Panel("rivals", "Where a rival is better", "Which rival beats us, and at what?", _beaten(bench.rows)),
        Panel("trials", "Trials", "What was concealed in each trial, and what was said?", _trials(bench)),
        Panel("made", "How it was made", "Why should these numbers be believed?", _made(bench)),
    )


def _aims(rows: Sequence[Row]) -> Grid:
    lines = []
    for aim in AIMS:
        row = find(rows, OURS, aim.metric, aim.group)
        state = reached(aim, row)
        lines.append((aim.metric, _group(aim.group), _limits(aim), *_value(row), Cell(state, _TONES[state])))
    note = "Intervals of 95 %. An aim is compared with the number itself; with few trials the interval is wide."
    head = ("Number", "Trials", "Aim", "Here", "Interval", "Of", "")
    return Grid("Aims of the diagnosis", head, tuple(lines), "llrrrrl", note)


def _limits(aim: Aim) -> str:
    text = percent if aim.metric in SHARES else number
    if aim.least is not None and aim.most is not None:
        return f"{text(aim.least)} to {text(aim.most)}"
    return f"≥ {text(aim.least)}" if aim.least is not None else f"≤ {text(aim.most)}"


def _value(row: Row | None) -> tuple[str, str, str]:
    """The number, its interval, and of how many."""
    if row is None:
        return MISSING, MISSING, MISSING
    text = percent if row.kind == "share" else number
    interval = MISSING if row.low is None or row.high is None else f"{text(row.low)} to {text(row.high)}"
    return text(row.value), interval, str(row.of) if row.right is None else f"{row.right} of {row.of}"


def _group(group: str) -> str:
    named = {ALL: "all", STRONG: "strength ≥ 300", "nothing": "nulls: nothing", "within": "nulls: within sigma"}
    return named.get(group, "nulls: beyond sigma" if group == "beyond" else f"strength {group}")


def _scores(rows: Sequence[Row], methods: Sequence[str]) -> tuple[Block, ...]:
    groups = tuple(dict.fromkeys(row.group for row in rows))
    blocks = []
    for group in groups:
        lines: list[tuple[str | Cell, ...]] = []
        for metric in (*SHARES, *MEDIANS):
            found = [find(rows, method, metric, group) for method in methods]
            if any(found):
                lines.append(
                    (metric, *(_cell(row, method == OURS) for row, method in zip(found, methods, strict=True)))
                )
        grid = Grid(f"Score: {_group(group)}", ("Number", *methods), tuple(lines), "l" + "r" * len(methods), _NOTE)
        blocks.append(grid if group == ALL else Fold(_group(group), (grid,)))
    return tuple(blocks)


_NOTE = (
    "Shares with exact binomial intervals of 95 %, right of tried; medians with distribution-free intervals; those "
    "of rivals are in score.json. Held-out residual and p-value are each method's own statement; all else is "
    "compared with what the seals held."
)


def _cell(row: Row | None, whole: bool) -> str:
    """A number, its interval if `whole`, and of how many, in little room."""
    if row is None:
        return MISSING
    scale, digits, sign = (100.0, 2, " %") if row.kind == "share" else (1.0, 3, "")
    value, *ends = (MISSING if x is None else number(scale * x, digits) for x in (row.value, row.low, row.high))
    interval = "" if row.low is None or not whole else f" [{', '.join(ends)}]"
    return f"{value}{sign}{interval} {row.of if row.right is None else f'{row.right}/{row.of}'}"


def _curves(rows: Sequence[Row], methods: Sequence[str]) -> Picture:
    with draw.style():
        sheet = Sheet(figsize=(draw.WIDTH, 2.6), layout="constrained")
        for axes, metric in zip(sheet.subplots(1, len(_DRAWN), sharey=True), _DRAWN, strict=True):
            for index, method in enumerate(methods):
                mine = [r for r in rows if (r.method, r.metric) == (method, metric) and r.group.isdigit()]
                mine.sort(key=lambda row: float(row.group))
                x = [float(row.group) * 1.04 ** (index - len(methods) / 2) for row in mine]
                y = [row.value or 0.0 for row in mine]
                ends = [[max(0.0, v - (r.low or 0.0)) for v, r in zip(y, mine, strict=True)],
                        [max(0.0, (r.high or 0.0) - v) for v, r in zip(y, mine, strict=True)]]  # fmt: skip
                style = {"color": draw.SERIES[index % len(draw.SERIES)], "markersize": 3.5, "linewidth": 1.0}
                axes.errorbar(x, y, yerr=ends if mine else None, marker="o", elinewidth=0.5, label=method, **style)
            axes.set(title=metric, xlabel="strength", ylim=(-0.03, 1.03), xscale="log", xlim=(30.0, 1400.0))
            axes.set_xticks([40.0, 100.0, 300.0, 1000.0], ["40", "100", "300", "1000"])
            axes.minorticks_off()
        sheet.axes[0].set_ylabel("share")
        handles, labels = sheet.axes[0].get_legend_handles_labels()
        sheet.legend(handles, labels, loc="outside lower center", ncols=min(6, len(methods)))
        return draw.picture(sheet, "Share of trials detected, placed and named against strength, a curve a method")


def _beaten(rows: Sequence[Row]) -> tuple[Block, ...]:
    pairs = beaten(rows)
    if not pairs:
        tried = {row.method for row in rows} - {OURS}
        return (Text("Nowhere in this table." if tried and tried != set() else "No rival was run."),)
    lines = tuple(
        (ours.metric, _group(ours.group), _cell(ours, True), best.method, _cell(best, True)) for ours, best in pairs
    )
    note = "By the number itself: where the intervals overlap, the difference may be chance."
    return (Grid("Better rivals", ("Number", "Trials", OURS, "Rival", "Its number"), lines, "llrlr", note),)


def _trials(bench: Bench) -> tuple[Block, ...]:
    given: dict[str, list[Answer]] = {}
    for answer in bench.answers:
        given.setdefault(answer.trial, []).append(answer)
    blocks = []
    for method in dict.fromkeys(answer.method for answer in bench.answers):
        lines = []
        for truth in sorted(bench.truths, key=lambda truth: (truth.level, truth.kind, truth.trial)):
            answer = next(entry for entry in given[truth.trial] if entry.method == method)
            lines.append((truth.trial, number(truth.level), concealed(truth), said(answer)))
        grid = Grid(f"Trials: {method}", ("Trial", "Strength", "Concealed", "Said"), tuple(lines), "krll")
        blocks.append(grid if method == OURS else Fold(method, (grid,)))
    return tuple(blocks)


def concealed(truth: Truth) -> str:
    """What was concealed in a trial."""
    if truth.kind != "concealed":
        return _group(truth.kind) + "".join(f"; {e.name} by {number(e.sigmas, 2)} sigma" for e in truth.beyond)
    return "; ".join(f"{_suspect(effect)} ({effect.name})" for effect in truth.effects)


def said(answer: Answer) -> str:
    """What a method said of a trial."""
    if answer.failure:
        return f"no answer: {answer.failure[:120]}"
    if answer.finds:
        return "; ".join(_suspect(claim) for claim in answer.finds)
    return f"{answer.verdict}{', mismatch detected' if answer.detected else ''}"


def _suspect(one: Suspect) -> str:
    channels = " ".join(one.channels) if one.port == "transducer" else ""
    return f"{one.family} at {' '.join(part for part in (one.port, one.axis, channels) if part)}"


def _made(bench: Bench) -> tuple[Block, ...]:
    return (
        Text(f"Made by: {bench.command}"),
        Text(
            "How the truth is kept from the methods",
            (
                f"Each method runs in {bench.isolation}.",
                "What is concealed was sealed when the trial was made (X25519, AES-256-GCM, padded), "
                "with the seal's SHA-256 in the trial. Seals were broken when all answers, or those before the "
                "first that is missing, were written and their digests in ledger.json.",
                f"Trials carry random names; their specifications come from the seed {bench.seed}, which was not "
                "told to any method.",
            ),
        ),
        Text("Rivals, all on the same recordings and the same plant", tuple(f"{k}: {v}" for k, v in RIVALS.items())),
    )
