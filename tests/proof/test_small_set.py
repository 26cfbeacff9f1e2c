"""The small set: verdicts that were right stay right, and a null claims no find.

Each trial goes the bench's whole way: unpacked under a name that says nothing, diagnosed by a process that sees neither
seal's key nor tests, and only then compared with what its seal holds.
"""

from __future__ import annotations

import pytest

from proof import answer
from proof.bundle import SEAL, SEAL_DIGEST, member
from proof.match import match
from proof.methods import Job, answer_trial
from proof.small import FOLDER, KEY
from proof.trials import break_seal
from proof.words import OURS

TRIALS = sorted(path.stem for path in FOLDER.glob("*.tar"))


def test_the_set_is_whole() -> None:
    assert len(TRIALS) == 2


@pytest.mark.validation  # eight minutes on one core
@pytest.mark.parametrize("name", TRIALS[1:])
def test_what_is_concealed_is_told(name: str) -> None:
    verdict_is_right(name)


@pytest.mark.validation
@pytest.mark.parametrize("name", TRIALS[:1])
def test_nothing_is_told_where_nothing_is_concealed(name: str) -> None:
    verdict_is_right(name)


def verdict_is_right(name: str) -> None:
    content = (FOLDER / f"{name}.tar").read_bytes()
    given = answer.decode(answer_trial(Job(name, content, (OURS,), timeout_s=900.0))[OURS])
    assert given.failure == ""
    seal, stated = member(content, SEAL), member(content, SEAL_DIGEST).decode()
    truth = break_seal(seal, stated, KEY.read_bytes(), name)
    if not truth.effects:
        assert given.finds == () and given.verdict == "none"
        return
    judged = match(given, truth.effects)
    assert all(entry.place and entry.physics for entry in judged), given
    assert given.held_out is not None and given.held_out.after < given.held_out.before
