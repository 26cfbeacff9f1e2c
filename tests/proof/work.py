"""The bench's working folder: what has been done stays done, so that an interrupted bench goes on where it stopped.

plan.json            what was asked for; specifications of trials are drawn again from its seed
key                  breaks the seals; readable by the owner, and covered while a method runs
trials/NAME.tar      a campaign and its seal
answers/METHOD/NAME.json
isolation            what the methods ran in
ledger.json          digests of all seals and answers that are scored, written before any seal is broken
"""

from __future__ import annotations

import os
import secrets
from pathlib import Path

import msgspec

from proof import answer, seal
from proof.answer import Answer, Part
from proof.bundle import SEAL, SEAL_DIGEST, member
from proof.trials import Maker, Order, break_seal, generator
from proof.truth import Truth
from proof.words import Split


class BenchError(Exception):
    """Something that a user of the bench can put right."""


class Plan(Part, frozen=True, kw_only=True):
    """What a bench consists of; the trials' names are in no relation to their order."""

    split: Split
    seed: int
    names: tuple[str, ...]
    command: str


class Ledger(Part, frozen=True, kw_only=True):
    """SHA-256 of every seal and every answer that is scored, taken before any seal was broken."""

    seals: dict[str, str]
    answers: dict[str, dict[str, str]]


class Work:
    """A working folder; `plan` is what it holds, or what a new one is made for, and `maker` who makes its trials."""

    def __init__(
        self, folder: Path, split: Split, count: int, seed: int | None, command: str, maker: Maker | None = None
    ) -> None:
        self._maker = maker
        self.folder = folder.absolute()
        plan_file, key_file = self.folder / "plan.json", self.folder / "key"
        if plan_file.is_file():
            self.plan = msgspec.json.decode(plan_file.read_bytes(), type=Plan)
            asked = (split, count, self.plan.seed if seed is None else seed)
            if asked != (self.plan.split, len(self.plan.names), self.plan.seed):
                raise BenchError(
                    f"{self.folder} holds {len(self.plan.names)} {self.plan.split} trials of another bench\n"
                    "  -> repeat its command to go on with it, or give another folder with --work"
                )
        else:
            self.folder.mkdir(parents=True, exist_ok=True)
            _create_private(key_file, seal.new_key())
            # Specifications could be drawn again from the seed: unless asked for, nobody can guess it.
            self.plan = Plan(
                split=split,
                seed=secrets.randbits(63) if seed is None else seed,
                names=tuple(seal.random_name() for _ in range(count)),
                command=command,
            )
            _create_private(plan_file, msgspec.json.encode(self.plan))
        self.key = key_file.read_bytes()

    @property
    def maker(self) -> Maker:
        """Who makes the trials: the generator of this checkout, unless another was given."""
        return self._maker or generator()

    @property
    def isolation(self) -> str:
        """What the methods ran in, as noted when they did."""
        return (self.folder / "isolation").read_text(encoding="utf-8")

    def begin(self, isolation: str) -> None:
        """Note what methods run in. Raises BenchError if some seals were broken and others were not."""
        path = self.folder / "ledger.json"
        if path.is_file() and len(_ledger(path).seals) < len(self.plan.names):
            raise BenchError(
                f"{self.folder} was judged as far as it was answered: its other trials are lost\n"
                "  -> a new bench needs new trials: give another folder with --work"
            )
        _replace(self.folder / "isolation", isolation.encode())

    def orders(self) -> list[Order]:
        """Trials that are still to be made."""
        specifications = self.maker.draw(self.plan.split, len(self.plan.names), self.plan.seed)
        public = seal.public(self.key)
        return [
            Order(name, specification, public)
            for name, specification in zip(self.plan.names, specifications, strict=True)
            if not self._trial(name).is_file()
        ]

    def keep_trial(self, name: str, content: bytes) -> None:
        """Store a trial that was made."""
        _replace(self._trial(name), content)

    def trial(self, name: str) -> bytes:
        """Return a trial's packed folder."""
        return self._trial(name).read_bytes()

    def unanswered(self, methods: tuple[str, ...]) -> list[tuple[str, tuple[str, ...]]]:
        """Trials, in the order of their names, with the methods that have no answer to them yet."""
        pairs = []
        for name in sorted(self.plan.names):
            left = tuple(method for method in methods if not self._answer(method, name).is_file())
            if left:
                pairs.append((name, left))
        return pairs

    def keep_answer(self, name: str, method: str, content: bytes) -> None:
        """Store an answer."""
        _replace(self._answer(method, name), content)

    def answered(self, methods: tuple[str, ...]) -> list[str]:
        """Trials, in the order of their names, before the first one that a method has not answered.

        A prefix of random names is no choice: which trials take long says what is in them.
        """
        names = sorted(self.plan.names)
        missing = self.unanswered(methods)
        return names[: names.index(missing[0][0])] if missing else names

    def close(self, methods: tuple[str, ...]) -> Ledger:
        """Write the ledger of what is answered: from here on, no answer may change. Raises BenchError if one did."""
        names = self.answered(methods)
        if not names:
            raise BenchError("the first trial has no answer yet\n  -> go on without --answered")
        seals = {name: seal.digest(member(self.trial(name), SEAL)) for name in names}
        answers = {
            method: {name: seal.digest(self._answer(method, name).read_bytes()) for name in seals} for method in methods
        }
        path = self.folder / "ledger.json"
        ledger = Ledger(seals=seals, answers=answers)
        if path.is_file():
            before = _ledger(path)
            changed = [m for m in before.answers if m in answers and before.answers[m] != answers[m]]
            if changed or before.seals != seals:
                raise BenchError(
                    f"answers of {', '.join(changed) or 'no method'}, or seals, changed after seals were broken\n"
                    "  -> a new bench needs new trials: give another folder with --work"
                )
            ledger = Ledger(seals=seals, answers=before.answers | answers)
        _replace(path, msgspec.json.format(msgspec.json.encode(ledger), indent=1) + b"\n")
        return ledger

    def open(self, ledger: Ledger) -> tuple[list[Truth], list[Answer]]:
        """Break the seals and read the answers, both as the ledger has them."""
        truths = []
        for name, stated in ledger.seals.items():
            sealed, in_folder = (member(self.trial(name), file) for file in (SEAL, SEAL_DIGEST))
            if in_folder.decode().split()[0] != stated:
                raise seal.SealError(f"the digest in {name} is not the ledger's")
            truths.append(break_seal(sealed, stated, self.key, name))
        answers = [
            answer.decode(self._answer(method, name).read_bytes())
            for method, names in ledger.answers.items()
            for name in names
        ]
        return truths, answers

    def _trial(self, name: str) -> Path:
        return self.folder / "trials" / f"{name}.tar"

    def _answer(self, method: str, name: str) -> Path:
        return self.folder / "answers" / method / f"{name}.json"


def _ledger(path: Path) -> Ledger:
    return msgspec.json.decode(path.read_bytes(), type=Ledger)


def _create_private(path: Path, content: bytes) -> None:
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
        file.write(content)


def _replace(path: Path, content: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    aside = path.with_name(f".{path.name}.part")
    aside.write_bytes(content)
    # When a trial was done would tell how long it took, and a null takes less.
    os.utime(aside, (0, 0))
    aside.replace(path)
