"""How one loss of a recording is told, with its time as far as that is known."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

from kbs_process.campaign.config import RecordingEntry
from kbs_process.signals.records import BLOW, PUT_IN_ORDER, SPIKE, TRUNCATED, Loss
from kbs_process.studies.correlate import results
from kbs_process.studies.correlate.notices import lost, spikes
from kbs_process.studies.validate.run import in_words


@pytest.mark.parametrize(
    ("loss", "said"),
    [
        (Loss("gap", "a.mcap, wrench", 3, 1.0, 2.5), "3 x gap, 1.0000 to 2.5000 s, a.mcap, wrench"),
        (Loss("crc", "a.mcap", 1, 1.0, 1.0), "1 x crc at 1.0000 s, a.mcap"),
        (Loss("crc", "a.mcap", 1), "1 x crc, a.mcap"),
        # What would have followed a break, nobody knows: a broken chunk's own end is no end of it.
        (Loss(TRUNCATED, "a.mcap", 1, 110.0, 120.0), "1 x truncated, from 110.0000 s on, a.mcap"),
    ],
)
def test_a_loss_is_told_with_its_time(loss: Loss, said: str) -> None:
    assert in_words(loss) == said


@pytest.mark.parametrize(("also", "severity"), [((), "info"), (("gap",), "warning")])
def test_what_was_put_in_order_alone_is_no_warning(also: tuple[str, ...], severity: str) -> None:
    entry = RecordingEntry("a", Path("a.mcap"), "A", "fit", 1, None, None, None)
    losses = [Loss(kind, "a: wrench", 3) for kind in (PUT_IN_ORDER, *also)]
    (notice,) = lost(entry, losses)
    assert notice.severity == severity
    assert "put in order: 3" in notice.what
    listed = tuple(Loss(kind=one.kind, where=one.where, count=one.count) for one in losses)
    recording = results.Recording(
        name="a", file="a.mcap", trajectory="A", role="fit", repeat=1, sha256="0" * 64, duration_s=1.0,
        losses=listed,
    )  # fmt: skip
    assert [one.kind for one in recording.lost] == list(also)


@pytest.mark.parametrize(
    ("losses", "said"),
    [
        ([Loss("gap", f"a: {key}", 10, 12.0, 14.2) for key in ("wrench", "angle")],
         "gap: 10 of wrench, 10 of encoder, between 12.0 s and 14.2 s"),
        ([Loss("gap", "a: wrench", 3, t, t + 0.1) for t in (12.0, 14.1)],
         "gap: 6 of wrench, between 12.0 s and 14.2 s"),
        ([Loss(BLOW, f"a: wrench, {key}", 1, t, t) for key, t in (("Fz", 35.01), ("Ty", 35.02))],
         "blow: 1 of Fz, 1 of Ty, at 35.0 s"),
        ([Loss("crc", "a.mcap", 1, 3.0, 4.0)], "crc: 1, between 3.0 s and 4.0 s"),
        # Told by the reader and by what comes behind it: once.
        ([Loss("non-finite", "a.mcap, /w", 5, 3.0, 4.0), Loss("non-finite", "a: wrench", 5)],
         "non-finite: 5 of wrench, between 3.0 s and 4.0 s"),
        ([Loss("non-finite", "a.mcap, /w", 5, 3.0, 4.0)], "non-finite: 5 of /w, between 3.0 s and 4.0 s"),
    ],
)  # fmt: skip
def test_what_is_lost_is_counted_by_stream(losses: list[Loss], said: str) -> None:
    (notice,) = lost(RecordingEntry("a", Path("a.mcap"), "A", "fit", 1, None, None, None), losses)
    assert notice.what == said


def test_single_bad_samples_are_told_with_the_figures_with_and_without_them() -> None:
    entry = RecordingEntry("a", Path("a.mcap"), "A", "fit", 1, None, None, None)
    losses = (
        Loss(SPIKE, "a: wrench, Fz", 1, 50.0, 50.0, "off by 49.99: interpolated"),
        Loss(SPIKE, "a: wrench, Ty", 2, 30.0, 40.0, "at 30.0000, 40.0000 s, off by up to 3: interpolated"),
    )
    analyses = [SimpleNamespace(entry=entry, run=SimpleNamespace(losses=own)) for own in (losses, ())]
    judged = [
        SimpleNamespace(name="Torque", statistic="peak", value=value, unit="N m", verdict=verdict)
        for value, verdict in ((0.002, "pass"), (0.07, "fail"))
    ]
    (notice,) = spikes(analyses, judged[:1], judged[1:])  # type: ignore[arg-type]
    assert (
        "1 in Fz at 50.0000 s, off by 49.99: interpolated; 2 in Ty at 30.0000, 40.0000 s, off by up to 3: interpolated."
        in notice.what
    )
    assert notice.what.endswith("Torque: peak 0.0020 N m without them, 0.0700 N m with them (not met)")
    (alone,) = spikes(analyses, judged[:1], ())  # type: ignore[arg-type]
    assert alone.what.endswith("without them, and nothing can be judged with them")
    assert list(spikes(analyses[1:], judged[:1], ())) == []  # type: ignore[arg-type]
