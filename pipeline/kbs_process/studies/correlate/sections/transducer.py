"""The transducer's resonance next to the bands: what it adds to the torque that is read."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from kbs_process.report import draw
from kbs_process.report.panel import Block, Figure, Fold, Grid, Panel, Picture, Text
from kbs_process.report.prose import Prose
from kbs_process.report.tables import Table, Tables
from kbs_process.report.text import frame_label, measure, number, percent, unit
from kbs_process.signals.records import Array
from kbs_process.studies.correlate.choose import band_label, main_frame
from kbs_process.studies.correlate.results import OnTransducer, Results

_SAYS = Prose("kbs_process.studies.correlate", "transducer")
_KINDS: dict[str, dict[str, Any]] = {
    "rigid": {"color": draw.RESIDUAL, "linewidth": 1.0, "zorder": 2},
    "modal": {"color": draw.PREDICTED, "linewidth": 2.2, "zorder": 2.5},
    "coupled": {"color": draw.MEASURED, "linewidth": 0.7, "zorder": 3},
}
_LABELS = {"rigid": "on a rigid base", "modal": "through the modes", "coupled": "coupled plant"}


QUESTION = "How much of a band's torque does the transducer's resonance make, and do both ways to compute it agree?"


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
        picture = _gain_curves(gain, edges, _low_passes(edges, gain.columns["f"]), alt)
        blocks.append(Figure("Gain from a rigid base to the transducer", (picture,), _SAYS.caption("gains")))
    frame = main_frame(results)
    blocks += [_gain_table(found), _error_table(results, found, frame)]
    spectrum = tables.read("transducer", f"{found.recording}.spectrum")
    if spectrum is not None:
        alt = "Root densities of three torques on a rigid base, through the modes, coupled"
        picture = _density_curves(spectrum, edges, alt)
        title = f"The disturbance of {found.recording}, both ways"
        blocks.append(Figure(title, (picture,), _SAYS.caption("spectra")))
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
        share = (worst.leak_rms / worst.error_rms) ** 2 if worst.error_rms > 0.0 else 0.0
        items.append(_SAYS("band", band=band_label(results, band), worst=worst, share=min(share, 1.0)))
    lowest = min(found.modes, key=lambda mode: mode.frequency_Hz)
    text = _SAYS("lowest", mode=lowest, recording=found.recording, frame=main_frame(results))
    return Text(text, tuple(items))


def _gain_table(found: OnTransducer) -> Grid:
    edges = sorted({entry.frequency_Hz for entry in found.gains})
    poses = sorted({entry.angle_rad for entry in found.gains})
    channels = list(dict.fromkeys(entry.channel for entry in found.gains))
    by_key = {(e.angle_rad, e.frequency_Hz, e.channel): e for e in found.gains}
    rows = tuple(
        (
            f"{number(math.degrees(pose))}°",
            *(
                "" if (one := by_key.get((pose, edge, channel))) is None else measure(one.gain, one.sigma)
                for edge in edges
                for channel in channels
            ),
        )
        for pose in poses
    )
    head = (f"Angle of {found.joint}", *(f"{channel} at {edge:g} Hz" for edge in edges for channel in channels))
    return Grid("Gain at the bands' edges", head, rows, "k" + "r" * (len(head) - 1), _SAYS("gain_note"))


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
    return Grid(f"Filter error of {found.recording}, {frame_label(frame)}", head, rows, "kkrrrrrr", _SAYS("error_note"))


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
    return Grid(f"Two models, {frame_label('T')}", head, rows, "kkrrrrrr", _SAYS("agreement_note", source=found.source))


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


def _gain_curves(table: Table, edges: Sequence[float], filters: dict[str, Array], alt: str) -> Picture:
    """Draw |H| of each torque at each pose, and behind the low-passes, `filters` by name, at the last pose."""
    f = table.columns["f"]
    channels = _channels(table)
    with draw.style():
        figure, axes = draw.row(2.5, len(channels), share_y=True)
        for axis, channel in zip(axes, channels, strict=True):
            names = [name for name in table.columns if name.startswith(f"{channel}.")]
            for index, name in enumerate(names):
                shade = 0.35 + 0.65 * (index + 1) / len(names)
                angle = name.split(".", 1)[1]
                axis.plot(f, table.columns[name], label=angle, color=draw.MEASURED, alpha=shade, linewidth=0.9)
            for index, (name, gain) in enumerate(filters.items()):
                color = draw.SERIES[(index + 1) % len(draw.SERIES)]
                axis.plot(f, gain * table.columns[names[-1]], label=f"behind {name}", color=color, linewidth=0.9)
            for edge in edges:
                axis.axvline(edge, color=draw.INK, linewidth=0.7, linestyle=(0, (1, 1.5)))
            draw.logarithmic(axis, "x", 0.2, float(f[-1]))
            draw.logarithmic(axis, "y", 1e-4, 200.0)
            axis.set_title(channel)
            axis.set_xlabel("frequency / Hz")
            axis.legend(fontsize=6, loc="lower left")
        axes[0].set_ylabel("read / on a rigid base")
        return draw.picture(figure, alt)


def _density_curves(table: Table, edges: Sequence[float], alt: str) -> Picture:
    """Draw the density of each torque on a rigid base, through the modes, and by the coupled plant."""
    f = table.columns["f"]
    channels = _channels(table)
    with draw.style():
        figure, axes = draw.row(2.5, len(channels))
        for axis, channel in zip(axes, channels, strict=True):
            top = 0.0
            for kind, look in _KINDS.items():
                density = table.columns.get(f"{channel}.{kind}")
                if density is not None:
                    axis.plot(f, np.sqrt(density), label=_LABELS[kind], **look)
                    top = max(top, float(np.sqrt(density[f > 0.1]).max()))
            for edge in edges:
                axis.axvline(edge, color=draw.INK, linewidth=0.7, linestyle=(0, (1, 1.5)))
            draw.logarithmic(axis, "x", max(0.1, float(f[1])), float(f[-1]))
            draw.logarithmic(axis, "y", 1e-5 * top, 2.0 * top)
            axis.set_title(channel)
            axis.set_xlabel("frequency / Hz")
        axes[0].set_ylabel("root density / N·m/√Hz")
        axes[0].legend(fontsize=6, loc="upper left")
        return draw.picture(figure, alt, form="png")


def _channels(table: Table) -> list[str]:
    return list(dict.fromkeys(name.split(".", 1)[0] for name in table.columns if name != "f"))
