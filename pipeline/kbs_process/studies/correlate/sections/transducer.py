"""The transducer's resonance next to the bands: what it adds to the torque that is read."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from kbs_process.report.panel import Block, Caption, Figure, Fold, Grid, Panel, Text
from kbs_process.report.tables import Tables
from kbs_process.report.text import frame_label, measure, number, percent, unit
from kbs_process.signals.records import Array
from kbs_process.studies.correlate.figures import transducer as figures
from kbs_process.studies.correlate.on_transducer import FilterErrorIn, OnTransducer
from kbs_process.studies.correlate.results import Results
from kbs_process.studies.correlate.sections.choose import band_label, main_frame

QUESTION = "How much of a band's torque does the transducer's resonance make, and do both ways to compute it agree?"
_GAINS = Caption(
    shown="Torque that the transducer reads over the torque that the article would exert on a rigid base, over "
    "frequency, at the first, middle and last pose; dotted: the bands' upper edges; coloured: the same behind each "
    "band's low-pass.",
    good="Close to 1 up to the edge, and the resonance's peak far below 1 behind the low-pass.",
    bad="Well above 1 at the edge: torques there are read too large. A peak near 1 behind the low-pass: the resonance "
    "leaks into the band, whatever excites it.",
    do="State the requirement in the lower band, stiffen the set-up, or divide the prediction's gain out.",
)
_SPECTRA = Caption(
    shown="The predicted disturbance of one recording: on a rigid base, the same through the modes, and by the plant "
    "with the elastic transducer in it.",
    good="All three agree below the resonance; the last two also at it.",
    bad="Modes and coupled plant differ below the resonance: the modal model is not that of this set-up. At the "
    "resonance alone they differ where friction answers the plate's motion, or a burst is shorter than the ring.",
    do="Check the modal file's pose, axes and interface against the rig's parameters.",
)


def panel(results: Results, tables: Tables) -> Panel:
    """Gains, filter errors with their uncertainty, and the agreement of both ways."""
    found = results.transducer
    if found is None or found.reason:
        reason = "" if found is None else found.reason
        none = reason or "The transducer counts as rigid, or no recording has a prediction."
        return Panel("transducer", "Transducer resonance", QUESTION, (Text(none),))
    edges = sorted({entry.frequency_Hz for entry in found.gains})
    blocks: list[Block] = [_words(results, found)]
    gain = tables.read("transducer", f"{found.recording}.gain")
    if gain is not None:
        alt = "Gain of the transducer's resonance over frequency for three torques"
        picture = figures.gains(gain, edges, _low_passes(edges, gain.columns["f"]), alt)
        blocks.append(Figure("Gain from a rigid base to the transducer", (picture,), _GAINS))
    frame = main_frame(results)
    blocks += [_gain_table(found), _error_table(results, found, frame)]
    spectrum = tables.read("transducer", f"{found.recording}.spectrum")
    if spectrum is not None:
        alt = "Root densities of three torques on a rigid base, through the modes, coupled"
        blocks.append(
            Figure(
                f"The disturbance of {found.recording}, both ways", (figures.spectra(spectrum, edges, alt),), _SPECTRA
            )
        )
    others = [other for other in ("T", "S") if other != frame and any(e.frame == other for e in found.errors)]
    folded = [_error_table(results, found, other) for other in others]
    blocks += [_agreement_table(results, found), Fold("Modes, and other frames", (_mode_table(found), *folded))]
    return Panel("transducer", "Transducer resonance", QUESTION, tuple(blocks))


def _low_passes(edges: Iterable[float], f: Array) -> dict[str, Array]:
    """Gain of the bands' low-pass, 1 / (1 + (f / edge)^8), half at the edge."""
    return {f"{edge:g} Hz": 1.0 / (1.0 + (f / edge) ** 8) for edge in edges}


def _words(results: Results, found: OnTransducer) -> Text:
    torques = [entry for entry in found.errors if entry.frame == main_frame(results) and entry.channel.startswith("T")]
    items = []
    for band in dict.fromkeys(entry.band for entry in torques):
        worst = max((e for e in torques if e.band == band), key=lambda e: e.error_peak)
        items.append(
            f"{band_label(results, band)}: at most {measure(worst.error_peak, worst.error_peak_sigma)} N m peak "
            f"({worst.channel}), where the torque on a rigid base peaks at {number(worst.rigid_peak)} N m; "
            f"{percent(_share(worst))} of the error's power leaks through the low-pass's flank."
        )
    lowest = min(found.modes, key=lambda mode: mode.frequency_Hz)
    text = (
        f"The lowest mode on the transducer lies at {measure(lowest.frequency_Hz, lowest.frequency_sigma_Hz)} Hz "
        f"with a damping of {percent(lowest.damping, 2)}. What it adds to {found.recording}'s predicted torque, "
        f"in frame {main_frame(results)}:"
    )
    return Text(text, tuple(items))


def _share(entry: FilterErrorIn) -> float:
    return min(1.0, (entry.leak_rms / entry.error_rms) ** 2) if entry.error_rms > 0.0 else 0.0


def _gain_table(found: OnTransducer) -> Grid:
    edges = sorted({entry.frequency_Hz for entry in found.gains})
    poses = sorted({entry.angle_rad for entry in found.gains})
    channels = list(dict.fromkeys(entry.channel for entry in found.gains))
    by_key = {(e.angle_rad, e.frequency_Hz, e.channel): e for e in found.gains}
    rows = tuple(
        (
            f"{number(math.degrees(pose))}°",
            *(
                measure(by_key[pose, edge, channel].gain, by_key[pose, edge, channel].sigma)
                for edge in edges
                for channel in channels
            ),
        )
        for pose in poses
    )
    head = (f"Angle of {found.joint}", *(f"{channel} at {edge:g} Hz" for edge in edges for channel in channels))
    note = "±: one standard deviation, from those of the modes' frequencies and dampings."
    return Grid("Gain at the bands' edges", head, rows, "k" + "r" * (len(head) - 1), note)


def _error_table(results: Results, found: OnTransducer, frame: str) -> Grid:
    head = ("Band", "Channel", "Rigid rms", "Error rms", "Of which leak", "Rigid peak", "Error peak", "Error / peak")
    rows = tuple(
        (
            band_label(results, e.band),
            f"{e.channel} / {unit(e.unit)}",
            number(e.rigid_rms),
            measure(e.error_rms, e.error_rms_sigma),
            number(e.leak_rms),
            number(e.rigid_peak),
            measure(e.error_peak, e.error_peak_sigma),
            percent(e.error_peak / e.rigid_peak if e.rigid_peak > 0.0 else None, 2),
        )
        for e in found.errors
        if e.frame == frame
    )
    note = (
        "Error: reading on the transducer less torque on a rigid base, in the band. Leak: its part above the band's "
        "upper edge. ±: one standard deviation from the modes; the disturbance itself counts as known."
    )
    return Grid(f"Filter error of {found.recording}, {frame_label(frame)}", head, rows, "kkrrrrrr", note)


def _agreement_table(results: Results, found: OnTransducer) -> Grid:
    head = (
        "Band",
        "Channel",
        "Coupled rms",
        "Modal rms",
        "Rigid rms",
        "Coupled less modal",
        "of the coupled",
        "of the noise",
    )
    rows = tuple(
        (
            band_label(results, e.band),
            f"{e.channel} / {unit(e.unit)}",
            number(e.coupled_rms),
            number(e.modal_rms),
            number(e.rigid_rms),
            number(e.difference_rms),
            percent(e.difference_rms / e.coupled_rms if e.coupled_rms > 0.0 else None, 2),
            percent(e.difference_rms / e.noise_rms if e.noise_rms > 0.0 else None, 2),
        )
        for e in found.agreement
    )
    note = f"Modes: {found.source}. Noise: the sensor's, in the band; a difference far below it cannot be measured."
    return Grid(f"Both ways, {frame_label('T')}", head, rows, "kkrrrrrr", note)


def _mode_table(found: OnTransducer) -> Grid:
    head = (f"Angle of {found.joint}", "Frequency / Hz", "Damping / %", *(f"About {a} / kg·m²" for a in "xyz"))
    rows = tuple(
        (
            f"{number(math.degrees(mode.angle_rad))}°",
            measure(mode.frequency_Hz, mode.frequency_sigma_Hz),
            measure(100.0 * mode.damping, 100.0 * mode.damping_sigma),
            *(number(value) for value in np.asarray(mode.effective)),
        )
        for mode in found.modes
    )
    return Grid("Modes, with their effective moments of inertia", head, rows, "krrrrr")
