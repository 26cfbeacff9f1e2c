"""The bench: make trials, let every method answer, close the ledger, break the seals, score."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from functools import partial
from pathlib import Path

from kbs_process.results.parallel import each
from proof import isolate
from proof.methods import Job, answer_trial
from proof.page import write_page
from proof.score import Bench, Row, encode, score
from proof.trials import make_sealed
from proof.work import Work

Tell = Callable[[str], None]


def finish(
    work: Work,
    methods: tuple[str, ...],
    pool: Executor,
    *,
    isolated: str,
    tell: Tell,
    answered: Callable[[Job], dict[str, bytes]] = answer_trial,
) -> None:
    """Make the trials of a bench that are missing, and let every method answer those that it has not.

    `isolated` says what methods run in, and `answered` runs them.
    """
    work.begin(isolated)
    tell(f"Each method runs in {work.isolation}")
    orders = work.orders()
    for done, (order, content) in enumerate(each(pool, partial(make_sealed, make=work.maker.make), orders), start=1):
        work.keep_trial(order.name, content)
        tell(f"made {order.name}, {done} of {len(orders)}")
    unanswered = work.unanswered(methods)
    todo = (Job(name, work.trial(name), left, hidden=(work.folder,)) for name, left in unanswered)
    for done, (job, given) in enumerate(each(pool, answered, todo), start=1):
        for method, content in given.items():
            work.keep_answer(job.trial, method, content)
        tell(f"answered {job.trial}, {done} of {len(unanswered)}: {', '.join(given)}")


def judge(work: Work, methods: tuple[str, ...], target: Path, *, command: str, tell: Tell) -> tuple[Row, ...]:
    """Close the ledger, break the seals, and write score and page to `target`.

    Of a bench that was not finished, the trials before the first one, by name, that lacks an answer.
    """
    ledger = work.close(methods)
    tell(f"{len(ledger.seals)} of {len(work.plan.names)} trials are scored")
    truths, answers = work.open(ledger)
    rows = score(truths, answers)
    bench = Bench(
        split=work.plan.split,
        # Trials that are not scored could be drawn again from it.
        seed=str(work.plan.seed)
        if len(truths) == len(work.plan.names)
        else "withheld: others drawn with it are sealed",
        command=command,
        isolation=work.isolation,
        rows=rows,
        truths=tuple(truths),
        answers=tuple(answers),
    )
    target.mkdir(parents=True, exist_ok=True)
    (target / "score.json").write_bytes(encode(bench))
    (target / "ledger.json").write_bytes((work.folder / "ledger.json").read_bytes())
    write_page(bench, target / "index.html")
    return rows


def isolation(scheduler: str | None) -> str:
    """What a method runs in."""
    elsewhere = " (on the machine of this command; each machine of the cluster does what it can)"
    return _ISOLATION[isolate.level()] + (elsewhere if scheduler is not None else "")


_ISOLATION = {
    "namespace": "namespaces of its own: the seals' key, the generator, other processes and the network are not there",
    "process": "a process, an environment and a folder of its own, and no more: there are no user namespaces here",
}
