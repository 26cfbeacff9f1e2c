"""Cross-coupling: what was mixed comes out unmixed, with the error that the matrix's own uncertainty leaves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from kbs_process.rig.model import substitute
from kbs_process.signals.records import Envelope, Spectrum
from kbs_process.stages import decouple
from plant.rigs import pointing_rig, transducer
from stages.gravity.synthetic import record


def _rig(seed=0, **changes):
    X = 0.02 * np.random.default_rng(seed).standard_normal((6, 6))
    rig = pointing_rig(transducer=transducer(s_x=0.005, **changes))
    return substitute(rig, {"transducer.cross_coupling": X, "transducer.bias": np.arange(6.0)}), X


def _run(rig):
    q = np.stack([np.linspace(0, 1, 4000), np.linspace(0.2, 1.4, 4000)], axis=1)
    return record(rig, "run", q, np.random.default_rng(1), bias=np.zeros(6))


def test_mixed_channels_come_out_unmixed():
    rig, X = _rig()
    true = _run(rig)
    raw = true.wrench.values @ (np.eye(6) + X).T + np.arange(6.0)
    S = np.cov(raw.T)[None].astype(complex)
    run = replace(true, wrench=true.wrench.derive(raw, "raw"))
    object.__setattr__(run, "spectrum", Spectrum(np.zeros(1), S, true.wrench.channels, 1, np.zeros(6)))
    object.__setattr__(run, "envelope", Envelope(np.zeros(1), raw.min(0)[None], raw.max(0)[None]))
    out = decouple.apply(run, decouple.fit(rig))
    np.testing.assert_allclose(out.wrench.values, true.wrench.values, atol=1e-9)
    np.testing.assert_allclose(out.spectrum.S[0].real, np.cov(true.wrench.values.T), atol=1e-8)
    assert np.all(out.envelope.low[0] <= true.wrench.values.min(axis=0) + 1e-9)
    assert np.all(out.envelope.high[0] >= true.wrench.values.max(axis=0) - 1e-9)
    assert "cross-coupling" in out.wrench.history[-1]


def test_stated_error_is_that_of_matrices_drawn_from_their_sigma():
    rig, X = _rig()
    model, true, rng = decouple.fit(rig), _run(rig).wrench, np.random.default_rng(2)
    stated = decouple.error(true, model)[::400]
    errors = []
    for _ in range(400):
        drawn = np.eye(6) + X + 0.005 * rng.standard_normal((6, 6))
        errors.append(true.values[::400] @ drawn.T @ model.matrix.T - true.values[::400])
    np.testing.assert_allclose(np.std(errors, axis=0), stated, rtol=0.15)


def test_a_subset_of_channels_uses_its_own_rows_and_columns():
    rig, X = _rig(channels=("Tx", "Ty"))
    model = decouple.fit(rig)
    np.testing.assert_allclose(model.matrix, np.linalg.inv(np.eye(2) + X[3:5, 3:5]))
    np.testing.assert_allclose(model.bias, [3.0, 4.0])
