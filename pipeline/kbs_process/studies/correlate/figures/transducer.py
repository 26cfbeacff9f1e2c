"""Amplification by the transducer's resonance, and what it makes of a spectrum."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from kbs_process.report import draw
from kbs_process.report.panel import Picture
from kbs_process.report.tables import Table
from kbs_process.signals.records import Array

_KINDS = {
    "rigid": {"color": draw.RESIDUAL, "linewidth": 1.0, "zorder": 2},
    "modal": {"color": draw.PREDICTED, "linewidth": 2.2, "zorder": 2.5},
    "coupled": {"color": draw.MEASURED, "linewidth": 0.7, "zorder": 3},
}
_LABELS = {"rigid": "on a rigid base", "modal": "through the modes", "coupled": "coupled plant"}


def gains(table: Table, edges: Sequence[float], filters: dict[str, Array], alt: str) -> Picture:
    """Draw |H| of each torque at each pose, and behind the low-passes, `filters` by name, at the last pose."""
    f = table.columns["f"]
    channels = _channels(table)
    with draw.style():
        figure = Figure(figsize=(draw.WIDTH, 2.5), layout="constrained")
        for axis, channel in zip(figure.subplots(1, len(channels), sharey=True), channels, strict=True):
            names = [name for name in table.columns if name.startswith(f"{channel}.")]
            for index, name in enumerate(names):
                shade = 0.35 + 0.65 * (index + 1) / len(names)
                look = {"color": draw.MEASURED, "alpha": shade, "linewidth": 0.9}
                axis.plot(f, table.columns[name], label=name.split(".", 1)[1], **look)
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
        figure.axes[0].set_ylabel("read / on a rigid base")
        return draw.picture(figure, alt)


def spectra(table: Table, edges: Sequence[float], alt: str) -> Picture:
    """Draw the density of each torque on a rigid base, through the modes, and by the coupled plant."""
    f = table.columns["f"]
    channels = _channels(table)
    with draw.style():
        figure = Figure(figsize=(draw.WIDTH, 2.5), layout="constrained")
        for axis, channel in zip(figure.subplots(1, len(channels)), channels, strict=True):
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
        figure.axes[0].set_ylabel("root density / N·m/√Hz")
        figure.axes[0].legend(fontsize=6, loc="upper left")
        return draw.picture(figure, alt, form="png")


def _channels(table: Table) -> list[str]:
    return list(dict.fromkeys(name.split(".", 1)[0] for name in table.columns if name != "f"))
