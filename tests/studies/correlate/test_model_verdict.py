"""Does the model predict what was measured? Told apart from whether the requirement is met."""

from __future__ import annotations

import msgspec
import pytest

from kbs_process.studies.correlate.notices import model_verdict
from kbs_process.studies.correlate.results import Merit, Results
from report.sample import command_results


def found(*rows: tuple[float, float, float, float], role: str = "held-out", sigma: float | None = 1.0) -> Results:
    """Results whose judged channels have these rms: measured, predicted, residual; and the explained variance."""
    sample = command_results()
    requirement = sample.requirements[0]
    first = next(one for one in sample.merit if (one.frame, one.band) == (requirement.frame, requirement.band))
    merit: list[Merit] = [
        msgspec.structs.replace(
            first,
            channel=f"T{'xyz'[index]}",
            role=role,
            sigma=sigma,
            measured_rms=measured,
            predicted_rms=predicted,
            residual_rms=residual,
            fraction_of_variance=explained,
        )
        for index, (measured, predicted, residual, explained) in enumerate(rows)
    ]
    return msgspec.structs.replace(sample, merit=tuple(merit))


@pytest.mark.parametrize(
    ("rows", "status"),
    [
        ([(1.0, 0.06, 1.0, 0.02)], "not testable"),  # a prediction 17 times below the noise
        ([(1.9, 1.9, 0.1, 0.99)], "not testable"),  # what agrees within the noise says nothing either
        ([(10.0, 9.0, 1.0, 0.99)], "correlated"),
        ([(10.0, 9.0, 3.0, 0.91), (1.0, 0.1, 1.0, 0.0)], "correlated"),  # the quiet channel does not count
        ([(10.0, 9.0, 1.0, 0.99), (10.0, 0.1, 10.0, 0.02)], "not correlated"),
        ([(10.0, 10.0, 20.0, -3.0)], "not correlated"),  # as large, with the opposite sign
        ([(1.0, 10.0, 10.0, -99.0)], "not correlated"),  # what is predicted would show, and does not
        ([(2.5, 1.0, 1.9, 0.4)], "correlated"),  # it errs by less than twice the uncertainty
    ],
)
def test_the_verdict_on_the_model(rows: list[tuple[float, float, float, float]], status: str) -> None:
    verdict = model_verdict(found(*rows))
    assert verdict is not None and verdict.status == status


def test_recordings_that_were_fitted_count_only_where_none_was_held_out() -> None:
    bad, good = (10.0, 0.1, 10.0, 0.0), (10.0, 9.0, 1.0, 0.99)
    fitted, held = found(bad, role="fit"), found(good)
    both = msgspec.structs.replace(held, merit=(*fitted.merit, *held.merit))
    assert [verdict.status for one in (fitted, both) if (verdict := model_verdict(one))] == [
        "not correlated",
        "correlated",
    ]


def test_without_a_prediction_or_its_uncertainty_there_is_nothing_to_test() -> None:
    assert model_verdict(found()) is None
    verdict = model_verdict(found((10.0, 9.0, 1.0, 0.99), sigma=None))
    assert verdict is not None and verdict.status == "not testable"
    assert "these recordings say nothing of the model there" in verdict.sentence
