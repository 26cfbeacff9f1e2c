"""Orders: which loads go with a joint's angle, measured beside predicted."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap, to_rgb

from kbs_process.report import draw, series, sheet
from kbs_process.report.panel import Block, Figure, Grid, Live, Panel, Picture, Text, View
from kbs_process.report.prose import Prose
from kbs_process.report.tables import Table, Tables
from kbs_process.report.text import MISSING, count, exact, frame_label, measure, number, unit
from kbs_process.signals.records import Array
from kbs_process.studies.correlate.choose import PLATES, by_role, folded
from kbs_process.studies.correlate.results import OrderPeak, OrdersIn, Results

_SAYS = Prose("kbs_process.studies.correlate", "orders")
_KINDS = ("measured", "threshold", "predicted")
# Colours of a map and their shares, each for twice the amplitude of the one before it.
_SHADES = (*((draw.MEASURED, share) for share in (0.0, 0.25, 0.5, 0.75, 1.0)), (draw.INK, 1.0))
_LEAST = 1e-3  # of a spectrum's greatest value, below which a picture shows none

Found = tuple[OrdersIn, Table, Table]  # what is said of a joint in a recording, its spectrum and its map


def panel(results: Results, tables: Tables) -> Panel:
    """Peaks, the spectra they stand in, maps over angle or rate, and what the recordings can show."""
    question = "Which disturbances go with a joint's angle, and does the model predict them?"
    roles = {one.name: place for place, one in enumerate(by_role(results.recordings))}
    said = sorted(results.orders, key=lambda one: roles.get(one.recording, len(roles)))
    found = [
        (one, spectrum, cells)
        for one in said
        if (spectrum := tables.read("orders", f"{one.recording}.{one.joint}")) is not None
        and (cells := tables.read("orders", f"{one.recording}.{one.joint}.map")) is not None
    ]
    if not found:
        return Panel("orders", "Orders", question, (Text(_SAYS("none")),))
    frame = frame_label(results.campaign.frame)
    views = tuple(_view(*one) for one in found)
    spectra = Figure(
        f"Amplitude over order, {frame}",
        tuple(_spectrum(one, spectrum) for one, spectrum, _ in found[:PLATES]),
        _SAYS.caption("spectra", alarm=found[0][0].false_alarm),
        Live("orders", _KINDS, views, two_scales=False, along=("order", "k", "1/turn"), choosing="Joint"),
    )
    maps = tuple(_map(one, cells) for one, _, cells in found if one.peaks)[:PLATES]
    title = f"Amplitude over angle or rate, and order, {frame}"
    drawn = (Figure(title, maps, _SAYS.caption("maps")),) if maps else ()
    return Panel("orders", "Orders", question, (*_peaks(said), spectra, *drawn, _limits(said)))


def _peaks(said: list[OrdersIn]) -> tuple[Block, ...]:
    rows = tuple(
        (
            one.recording,
            one.joint,
            f"{peak.channel} / {unit(peak.unit)}",
            f"{number(peak.order, 4)} ± {number(0.5 * one.resolution, 2)}",
            "below threshold" if peak.measured is None else measure(peak.measured, peak.sigma),
            number(peak.predicted),
            ", ".join((*peak.known, *(["or a fixed frequency"] if peak.fixed else []))) or MISSING,
        )
        for one in said
        for peak in one.peaks
    )
    if not rows:
        return (Text(_SAYS("no_peak", alarm=said[0].false_alarm)),)
    head = ("Recording", "Joint", "Channel", "Order", "Measured", "Predicted", "Coincides with")
    return folded(Grid("Peaks over order", head, rows, "lllrrrl", _SAYS("peaks_note")), "Further peaks")


def _limits(said: list[OrdersIn]) -> Grid:
    rows = tuple(
        (
            one.recording,
            one.joint,
            f"{count(one.windows, 'window')} of {number(math.degrees(one.window_rad))}°",
            " to ".join(dict.fromkeys(number(math.degrees(rate)) for rate in one.rates)),
            f"{number(one.lowest)} to {number(one.highest)}",
            "angle" if one.by_angle else f"{exact(one.band_Hz)}\u00a0Hz",
            number(one.resolution),
            ", ".join(f"{name} {exact(order)}" for name, order in one.above.items()) or MISSING,
        )
        for one in said
    )
    head = ("Recording", "Joint", "Windows", "Rate / °/s", "Orders shown", "Set by", "Line width", "Left out")
    return Grid("What the recordings can show", head, rows, "llrrrlrl", _SAYS("limits_note"))


def _view(one: OrdersIn, table: Table, _: Table) -> View:
    marks = tuple((peak.order, "fail") for peak in one.peaks)
    shown = table.columns["order"] >= one.lowest
    channels = [
        (
            channel,
            table.unit(channel),
            [table.columns[name][shown] for kind in _KINDS if (name := f"{channel}.{kind}") in table.columns],
        )
        for channel in table.channels
    ]
    return series.spectra(one.recording, one.joint, table.columns["order"][shown], channels, marks)


def _spectrum(one: OrdersIn, table: Table) -> Picture:
    """Draw measured and predicted amplitude of every channel with its threshold, the named peaks marked."""
    title = f"{one.recording}, {one.joint}"
    order = table.columns["order"]
    shown = order >= one.lowest
    with draw.style():
        plate = sheet.Sheet(len(table.channels), 1, 1.2, gap=0.12)
        for row, channel in enumerate(table.channels):
            names = [kind for kind in _KINDS if f"{channel}.{kind}" in table.columns]
            curves = {kind: _greatest(order[shown], table.columns[f"{channel}.{kind}"][shown]) for kind in names}
            top = max(float(np.max(values, initial=1e-300)) for _, values in curves.values())
            low = max(min(float(np.min(values, initial=top)) for _, values in curves.values()), _LEAST * top)
            x = (one.lowest, one.highest)
            panel = plate.panel(row, 0, x, (0.5 * low, 2.0 * top), logarithmic=True)
            for kind, (x_values, values) in curves.items():
                panel.curve(x_values, np.maximum(values, 0.5 * low), draw.LINES[kind])
            _name(panel, [peak for peak in one.peaks if peak.channel == channel])
            last = row == len(table.channels) - 1
            panel.frame(f"{channel} / {unit(table.unit(channel))}", below="order / cycles a turn" if last else None)
        plate.key(0, names)
        return draw.picture(plate.figure, f"{title}: amplitude over order of {', '.join(table.channels)}", title, "png")


def _greatest(x: Array, values: Array) -> tuple[Array, Array]:
    """Keep the greatest value of each of many equal steps of log x."""
    steps = np.floor(np.log(x / x[0]) * (900.0 / np.log(x[-1] / x[0])))
    starts = np.flatnonzero(np.diff(steps, prepend=-1.0))
    return x[starts], np.maximum.reduceat(np.where(np.isfinite(values), values, 0.0), starts)


def _name(panel: sheet.Panel, peaks: list[OrderPeak]) -> None:
    """Write the orders of the peaks, the greatest first, where no other stands."""
    taken: list[float] = []
    for peak in peaks:
        place = float(panel.x.place(peak.order))
        if all(abs(place - other) > 0.3 for other in taken):
            taken.append(place)
            height = max(peak.measured or 0.0, peak.predicted or 0.0)
            at = min(float(panel.y.place(height)) + 0.03, panel.y.end - 0.1)
            panel.sheet.axes.text(place, at, number(peak.order), ha="center", va="bottom", fontsize=6, color=draw.LIMIT)


def _map(one: OrdersIn, table: Table) -> Picture:
    """Draw the amplitude of the channel that has most, measured and predicted, over angle or rate and order."""
    over = next(name for name in ("rate", "angle") if f"{name}.from" in table.columns)
    rows = len(np.unique(table.columns[f"{over}.from"]))

    def cells(name: str) -> Array:
        return table.columns[name].reshape(rows, -1)

    channel = max(table.channels, key=lambda name: float(np.nanmax(cells(f"{name}.measured"))))
    sides = [side for side in ("measured", "predicted") if f"{channel}.{side}" in table.columns]
    x = np.append(cells("order.from")[0], cells("order.to")[0, -1])
    y = np.degrees(np.append(cells(f"{over}.from")[:, 0], cells(f"{over}.to")[-1, 0]))
    levels = max(float(np.nanmedian(cells(f"{channel}.measured"))), 1e-300) * 2.0 ** np.arange(1.0, len(_SHADES))
    pale = [1.0 - share * (1.0 - np.array(to_rgb(color))) for color, share in _SHADES]
    colors, norm = (
        ListedColormap(list(map(tuple, pale))),
        BoundaryNorm([0.0, *levels, 2.0 * levels[-1]], len(_SHADES), clip=True),
    )
    title = f"{one.recording}, {one.joint}, {channel} / {unit(table.unit(channel))}"
    with draw.style():
        figure, axes = draw.row(2.3, len(sides), share_y=True)
        for axis, side in zip(axes, sides, strict=True):
            axis.set_facecolor(draw.SHADE)
            mesh = axis.pcolormesh(x, y, np.ma.masked_invalid(cells(f"{channel}.{side}")), cmap=colors, norm=norm)
            draw.logarithmic(axis, "x", float(x[0]), float(x[-1]))
            axis.set(title=side, xlabel="order / cycles a turn")
        bar = figure.colorbar(mesh, ax=axes, pad=0.01, spacing="uniform")
        bar.set_ticks(levels.tolist(), labels=[number(level, 2) for level in levels])
        axes[0].set_ylabel(f"{over} / {'°/s' if over == 'rate' else '°'}")
        return draw.picture(figure, f"{title}: amplitude over {over} and order", title, "png")
