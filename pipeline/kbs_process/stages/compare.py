"""Figures of merit: how well a prediction describes a measurement, channel by channel, in a band."""

from __future__ import annotations

import numpy as np
from scipy.signal import welch

from kbs_process.results.records import Record
from kbs_process.signals.grid import overlap
from kbs_process.signals.records import Array, Signal

# Fewer valid samples than this say nothing about a correlation.
MIN_SAMPLES = 16


class Merit(Record, frozen=True, kw_only=True):
    """Agreement on one channel; rms and peak in the channel's unit, None where it is not defined.

    fraction_of_variance = 1 - var(measured - predicted) / var(measured): 1 is perfect, 0 is no better than
    predicting nothing, negative is worse than that. spectral_ratio is the geometric mean over the band's
    frequencies of predicted over measured power density. pessimism = predicted peak / measured peak.
    """

    channel: str
    unit: str
    measured_rms: float | None
    predicted_rms: float | None
    residual_rms: float | None
    measured_peak: float | None
    predicted_peak: float | None
    correlation: float | None
    fraction_of_variance: float | None
    spectral_ratio: float | None
    pessimism: float | None


def compare(measured: Signal, predicted: Signal, passband: tuple[float, float]) -> tuple[Merit, ...]:
    """Compare two signals, over the samples that are valid in both; `passband` in Hz."""
    a, b = overlap(measured, predicted)
    valid = a.valid & b.valid
    if np.count_nonzero(valid) < MIN_SAMPLES:
        return ()
    return tuple(
        _merit(channel, unit, a.column(channel)[valid], b.column(channel)[valid], a.rate, passband)
        for channel, unit in zip(a.channels, a.units, strict=True)
        if channel in b.channels
    )


def _merit(channel: str, unit: str, m: Array, p: Array, rate: float, passband: tuple[float, float]) -> Merit:
    variance_m, variance_p = float(np.var(m)), float(np.var(p))
    covariance = float(np.mean((m - m.mean()) * (p - p.mean())))
    peak_m, peak_p = float(np.max(np.abs(m))), float(np.max(np.abs(p)))
    defined = variance_m > 0 and variance_p > 0
    return Merit(
        channel=channel,
        unit=unit,
        measured_rms=_rms(m),
        predicted_rms=_rms(p),
        residual_rms=_rms(m - p),
        measured_peak=peak_m,
        predicted_peak=peak_p,
        correlation=covariance / float(np.sqrt(variance_m * variance_p)) if defined else None,
        fraction_of_variance=1.0 - float(np.var(m - p)) / variance_m if variance_m > 0 else None,
        spectral_ratio=_spectral_ratio(m, p, rate, passband) if defined else None,
        pessimism=peak_p / peak_m if peak_m > 0 else None,
    )


def _rms(x: Array) -> float:
    return float(np.sqrt(np.mean(x**2)))


def _spectral_ratio(m: Array, p: Array, rate: float, passband: tuple[float, float]) -> float | None:
    """Geometric mean of P_pp / P_mm over the passband, Welch with segments of a quarter of the record."""
    segment = max(MIN_SAMPLES, len(m) // 4)
    f, power_m = welch(m, rate, nperseg=segment)
    _, power_p = welch(p, rate, nperseg=segment)
    inside = (f >= max(passband[0], f[1])) & (f <= passband[1]) & (power_m > 0) & (power_p > 0)
    if not inside.any():
        return None
    return float(np.exp(np.mean(np.log(power_p[inside] / power_m[inside]))))
