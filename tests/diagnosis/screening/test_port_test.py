"""The port test's level and power by Monte Carlo; what it says of ports that channels cannot tell apart."""

from __future__ import annotations

import numpy as np
import pytest

from kbs_process.diagnosis.screening.ports import Cells, PortModel, benjamini_yekutieli, fisher, port_test, sine_window

pytestmark = pytest.mark.slow

C, D, CELLS, NU = 6, 1, 20, 24


def drawn(rng: np.random.Generator, *shape: int) -> np.ndarray:
    """Circular complex normal numbers of unit variance."""
    return (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2.0)


def experiment(rng: np.random.Generator, size: float, unknown: int = 0) -> tuple[Cells, list[PortModel]]:
    """Cells with an input at the first of three ports, whitened by a floor that is estimated from NU samples a cell."""
    true = drawn(rng, CELLS, C, C) + 2.0 * np.eye(C)
    noise = true @ drawn(rng, CELLS, C, NU)
    estimated = noise @ noise.conj().swapaxes(1, 2) / NU
    whiten = np.linalg.inv(np.linalg.cholesky(estimated))
    H = [drawn(rng, CELLS, C, D) for _ in range(3)]
    J = drawn(rng, CELLS, C, unknown)
    x = true @ drawn(rng, CELLS, C, 1) + size * H[0] @ drawn(rng, CELLS, D, 1)
    x = x + J @ rng.standard_normal((unknown, 1))
    cells = Cells(
        z=(whiten @ x)[:, :, 0],
        J=whiten @ J,
        seen=np.full(CELLS, C),
        precision=np.zeros(unknown),
        nu=np.full(CELLS, float(NU)),
        t=np.zeros(CELLS),
        f=np.ones(CELLS),
        trajectory=np.zeros(CELLS, dtype=int),
    )
    nothing = np.zeros((CELLS, C, 0), dtype=complex)
    return cells, [PortModel(name, whiten @ h, nothing) for name, h in zip("abc", H, strict=True)]


def test_the_right_port_is_refused_at_the_nominal_rate(capsys: pytest.CaptureFixture[str]) -> None:
    rng, runs = np.random.default_rng(1), 1000
    refused = 0
    for _ in range(runs):
        cells, ports = experiment(rng, 30.0)
        verdict = next(v for v in port_test(cells, ports[:1], 0.0).ports if v.name == "a")
        refused += not verdict.sufficient
    rate = refused / runs
    with capsys.disabled():
        print(f"\nport test: the right port refused in {100 * rate:.1f} % of {runs} (nominal 5 %)")
    assert rate == pytest.approx(0.05, abs=3.0 * np.sqrt(0.05 * 0.95 / runs))


def test_wrong_ports_are_refused_and_the_right_one_comes_first() -> None:
    rng = np.random.default_rng(2)
    for _ in range(20):
        cells, ports = experiment(rng, 10.0)
        best, *others = port_test(cells, ports, 0.0).ports
        assert best.name == "a" and not any(v.sufficient for v in others)
        assert best.explained > 0.95 and best.explained > max(v.explained for v in others)


def test_known_parameters_take_their_share_before_a_port_is_judged() -> None:
    rng = np.random.default_rng(3)
    cells, ports = experiment(rng, 5.0, unknown=4)
    best = port_test(cells, ports, 0.0).ports[0]
    assert best.name == "a" and best.sufficient
    without = Cells(
        **{name: getattr(cells, name) for name in cells.__slots__} | {"J": cells.J[:, :, :0], "precision": np.zeros(0)}
    )
    assert not any(v.sufficient for v in port_test(without, ports, 0.0).ports)


def test_an_uncertain_transfer_does_not_fail_the_right_port() -> None:
    rng = np.random.default_rng(4)
    cells, ports = experiment(rng, 100.0)
    wrong = ports[0].H * (1.0 + 0.05 * rng.standard_normal(ports[0].H.shape))
    blurred = [PortModel("a", wrong, ports[0].varied), *ports[1:]]
    assert not port_test(cells, blurred, 0.0).ports[0].sufficient
    best, *others = port_test(cells, blurred, 0.1).ports
    assert best.name == "a" and best.sufficient and not any(v.sufficient for v in others)


def test_ports_of_one_direction_are_named_together() -> None:
    rng = np.random.default_rng(5)
    cells, ports = experiment(rng, 10.0)
    twin = PortModel("twin", ports[0].H * drawn(rng, CELLS, 1, 1), ports[0].varied)
    verdicts = {v.name: v for v in port_test(cells, [*ports, twin], 0.0).ports}
    assert verdicts["a"].alike == ("twin",) and verdicts["twin"].alike == ("a",)
    assert verdicts["b"].alike == ()


def test_the_only_port_is_named_with_those_that_look_the_same_and_with_no_other() -> None:
    rng = np.random.default_rng(7)
    cells, ports = experiment(rng, 10.0)
    twin = PortModel("twin", ports[0].H * drawn(rng, CELLS, 1, 1), ports[0].varied)
    wider = PortModel("wider", np.concatenate([ports[0].H, drawn(rng, CELLS, C, 1)], axis=2), ports[0].varied)
    assert set(port_test(cells, [*ports, twin], 0.0).only) == {"a", "twin"}
    assert port_test(cells, [*ports, twin, wider], 0.0).only == ()  # it may be along a part of that
    assert port_test(cells, ports[1:], 0.0).only == ()  # none suffices
    assert port_test(cells, [wider, *ports[1:]], 0.0).only == ()  # two inputs do, which may be chance
    weak, ports = experiment(np.random.default_rng(8), 0.4)
    assert port_test(weak, ports, 0.0).only == ()  # several do
    none, ports = experiment(np.random.default_rng(6), 0.0)
    assert port_test(none, ports[:1], 0.0).only == ()  # nothing is there


def test_no_input_at_all_is_told() -> None:
    cells, ports = experiment(np.random.default_rng(6), 0.0)
    found = port_test(cells, ports, 0.0)
    assert found.log_p > np.log(1e-3) and not found.significant.any()


def test_of_nothing_no_port_takes_a_share() -> None:
    cells, ports = experiment(np.random.default_rng(6), 0.0)
    quiet = Cells(0.5 * cells.z, cells.J, cells.seen, cells.precision, cells.nu, cells.t, cells.f, cells.trajectory)
    assert all(verdict.explained == 0.0 for verdict in port_test(quiet, ports, 0.0).ports)


def test_cells_two_bins_apart_are_uncorrelated() -> None:
    taper = sine_window(400)
    spectrum = np.fft.fft(taper**2)
    assert abs(spectrum[2]) < 1e-12 < abs(spectrum[1])
    assert spectrum[0].real == pytest.approx(1.0)


def test_combined_p_values() -> None:
    assert fisher(np.array([0.5])) == pytest.approx(np.log(0.5))
    assert benjamini_yekutieli(np.array([1e-9, 0.5, 0.9]), 0.05).tolist() == [True, False, False]
