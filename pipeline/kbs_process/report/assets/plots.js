"use strict";
// Interactive time histories and spectra: one uPlot a channel, all of a figure with the same axis and cursor.
(() => {
  // The computed curve is broad and pale under the measured one, so that both show where they agree.
  const LOOKS = {
    static: { color: "predicted", width: 2.5 },
    predicted: { color: "predicted", width: 2.5 },
    measured: { color: "measured", width: 1 },
    residual: { color: "residual", width: 1 },
    threshold: { color: "fail", width: 1, dash: [6, 4] },
  };
  const LOWEST_FIRST = Object.keys(LOOKS); // the order in which curves are drawn
  // Colours are the page's, light or dark, at the time that something is drawn.
  const color = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  const ABSENT = -32768;
  const WHEEL = 0.8;

  const unpack = ({ middle, scale, codes }) => {
    const bytes = Uint8Array.from(atob(codes), (character) => character.charCodeAt(0));
    const data = new DataView(bytes.buffer);
    return Array.from({ length: bytes.length / 2 }, (_, i) => {
      const code = data.getInt16(2 * i, true);
      return code === ABSENT ? null : middle + scale * code;
    });
  };

  // Spectra and their places are packed by their logarithms.
  const powers = (packed) => unpack(packed).map((v) => (v === null ? null : 10 ** v));

  const curvesOf = (channel, logarithmic) => {
    const found = channel.curves.map((packed) => packed && (logarithmic ? powers(packed) : unpack(packed)));
    // A computed curve is left out where it is what was measured less the residual.
    const computed = (v, i) => (v === null || found[2][i] === null ? null : v - found[2][i]);
    return found.map((curve) => curve || found[0].map(computed));
  };

  const shown = (value) => (value === null || value === undefined ? "–" : value.toPrecision(4).replace("-", "−"));
  const SUPERSCRIPT = Object.fromEntries([..."-0123456789"].map((letter, i) => [letter, "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"[i]]));
  const raised = (v) => [...String(v)].map((letter) => SUPERSCRIPT[letter]).join("");
  const power = (v) => {
    const [digits, exponent] = v.toExponential(0).split("e");
    return v >= 0.001 && v < 1e4 ? String(+v.toPrecision(2)) : `${digits === "1" ? "" : `${digits}·`}10${raised(+exponent)}`;
  };
  // Ticks of a logarithmic axis: decades, their 1, 2 and 5, or over little equal steps.
  const rounds = (low, high) => {
    const decades = Math.log10(high / low);
    if (decades < 0.7) {
      const step = 10 ** Math.floor(Math.log10((high - low) / 2));
      return Array.from({ length: Math.floor(high / step) - Math.ceil(low / step) + 1 }, (_, i) => (Math.ceil(low / step) + i) * step).filter((_, i, all) => i % Math.ceil(all.length / 5) === 0);
    }
    const from = Math.floor(Math.log10(low));
    const every = Math.ceil(decades / 6);
    const digits = decades < 2.5 ? [1, 2, 5] : [1];
    return Array.from({ length: Math.ceil(decades) + 2 }, (_, i) => from + i).filter((e) => e % every === 0).flatMap((e) => digits.map((d) => d * 10 ** e)).filter((v) => v >= low && v <= high);
  };
  const tidy = (unit) => unit.replace("^2", "²").replaceAll(" ", "\u00a0");

  const element = (name, text, className) => {
    const made = document.createElement(name);
    if (text) made.textContent = text;
    if (className) made.className = className;
    return made;
  };

  const chooser = (label, options, changed) => {
    const frame = element("label", label);
    const select = element("select");
    options.forEach((option) => select.append(new Option(option, option)));
    select.addEventListener("change", changed);
    frame.append(select);
    return { frame, select };
  };

  function figure(root) {
    const { key, names, views, two_scales: twoScales, shortcuts, along: [along, symbol, unit], choosing } = JSON.parse(document.getElementById(`live-${root.dataset.key}`).textContent);
    const box = root.querySelector(".plots");
    const reading = root.querySelector(".reading");
    const unique = (field) => [...new Set(views.map((view) => view[field]))];
    let plots = [];
    let view = null;
    let mark = null; // index of the sample from which differences are read

    // Along a logarithmic axis one moves and zooms by factors.
    const scale = (x) => (view.places ? Math.log(x) : x);
    const back = (x) => (view.places ? Math.exp(x) : x);
    const zoom = (min, max) => plots.forEach((plot) => plot.setScale("x", { min, max }));
    const redraw = () => plots.forEach((plot) => plot.redraw(false));

    const under = (plot) => {
      const { ctx, bbox } = plot;
      ctx.save();
      ctx.beginPath();
      ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
      ctx.clip();
      ctx.fillStyle = color("shade");
      for (const [start, end] of view.shaded) {
        const left = plot.valToPos(start, "x", true);
        ctx.fillRect(left, bbox.top, Math.max(1, plot.valToPos(end, "x", true) - left), bbox.height);
      }
      ctx.restore();
    };

    const over = (plot, limit) => {
      const { ctx, bbox } = plot;
      const line = (x0, y0, x1, y1, color, dash) => {
        ctx.strokeStyle = color;
        ctx.setLineDash(dash);
        ctx.beginPath();
        ctx.moveTo(x0, y0);
        ctx.lineTo(x1, y1);
        ctx.stroke();
      };
      ctx.save();
      ctx.beginPath();
      ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
      ctx.clip();
      ctx.lineWidth = devicePixelRatio;
      for (const level of limit === null ? [] : [-limit, limit]) {
        const y = plot.valToPos(level, "y", true);
        line(bbox.left, y, bbox.left + bbox.width, y, color("fail"), [6, 4]);
      }
      for (const [place, tone] of view.marks) {
        const x = plot.valToPos(place, "x", true);
        line(x, bbox.top, x, bbox.top + bbox.height, color(tone), tone === "ink" ? [1, 3] : [5, 4]);
      }
      if (mark !== null) {
        const x = plot.valToPos(plot.data[0][mark], "x", true);
        line(x, bbox.top, x, bbox.top + bbox.height, color("ink"), [2, 3]);
      }
      ctx.restore();
    };

    const read = (index) => {
      if (mark === null || index === null || index === undefined) {
        reading.textContent = "";
        return;
      }
      const between = (values) => (values[index] === null || values[mark] === null ? null : values[index] - values[mark]);
      const parts = plots.filter((plot) => plot.measured).map((plot) => `Δ${plot.channel.name} ${shown(between(plot.data[plot.measured]))} ${tidy(plot.channel.unit)}`);
      reading.textContent = [`From the mark: Δ${symbol} ${shown(between(plots[0].data[0]))} ${unit}`, ...parts].join("  ·  ");
    };

    const wheel = (plot) => {
      plot.over.addEventListener("wheel", (event) => {
        if (!event.shiftKey) return;
        event.preventDefault();
        const turn = event.deltaY || event.deltaX;
        const factor = turn < 0 ? WHEEL : 1 / WHEEL;
        const { min, max } = plot.scales.x;
        const t = plot.data[0];
        const [low, middle, high] = [min, plot.posToVal(plot.cursor.left, "x"), max].map(scale);
        zoom(Math.max(t[0], back(middle - (middle - low) * factor)), Math.min(t.at(-1), back(middle + (high - middle) * factor)));
      }, { passive: false });
      let pressed = 0;
      plot.over.addEventListener("mousedown", (event) => { pressed = event.clientX; });
      plot.over.addEventListener("click", (event) => {
        if (Math.abs(event.clientX - pressed) > 3) return;
        mark = mark === plot.cursor.idx ? null : plot.cursor.idx;
        read(plot.cursor.idx);
        redraw();
      });
    };

    // Least and greatest of curves between two points.
    const extent = (curves, [from, to]) => curves.reduce(([low, high], curve) => {
      for (let i = from; i <= to; i++) {
        if (curve[i] === null) continue;
        if (curve[i] < low) low = curve[i];
        if (curve[i] > high) high = curve[i];
      }
      return [low, high];
    }, [Infinity, -Infinity]);

    // The plots of a channel: the residual has one of its own beneath the others, so that it hides nothing.
    const make = (channel, t, last) => {
      const all = curvesOf(channel, Boolean(view.places));
      const place = (i) => LOWEST_FIRST.indexOf(names[i]);
      const order = [...channel.curves.keys()].sort((i, j) => place(i) - place(j));
      const above = order.filter((i) => names[i] !== "residual");
      const beneath = order.filter((i) => names[i] === "residual");
      const [low, high] = extent(above.map((i) => all[i]), [0, t.length - 1]);
      const limit = channel.limit !== null && Math.max(-low, high) > 0.25 * channel.limit ? channel.limit : null;
      const groups = beneath.length ? [above, beneath] : [above];
      return groups.map((group) => panel(channel, t, group, all, {
        limit: group === above ? limit : null,
        shares: group === beneath && !twoScales ? order : null,
        ends: group === groups.at(-1),
        last,
      }));
    };

    // One plot; it has the scale of the curves `shares`, if there are any.
    const panel = (channel, t, group, all, { limit, shares, ends, last }) => {
      const logarithmic = Boolean(view.places);
      const range = (plot, low, high) => {
        const [least, most] = shares ? extent(shares.map((i) => all[i]), plot.series[0].idxs) : [low, high];
        const [bottom, top] = limit === null ? [least, most] : [Math.min(least, -limit), Math.max(most, limit)];
        const room = 0.06 * (top - bottom || Math.abs(top) || 1);
        return [bottom - room, top + room];
      };
      const log = logarithmic ? { distr: 3 } : {};
      const decades = (_, low, high) => (low > 0 ? [low / 2, high * 2] : [1, 10]); // of a plot that shows no point
      const ticks = logarithmic ? { splits: (_, __, low, high) => rounds(low, high), filter: (_, splits) => splits, values: (_, splits) => splits.map(power) } : {};
      const axis = { ...ticks, grid: { stroke: color("faint"), width: 1 }, font: "11px sans-serif", labelFont: "12px sans-serif", labelSize: 20, stroke: color("ink"), ticks: { stroke: color("rule"), width: 1 } };
      const residual = names[group[0]] === "residual";
      const height = (residual ? 70 : view.channels.length === 1 ? 270 : 112) + (ends ? (last ? 64 : 34) : 0);
      const plot = new uPlot({
        class: residual ? "beneath" : "above",
        width: box.clientWidth,
        height,
        cursor: { sync: { key, setSeries: false }, drag: { x: true, y: false, dist: 4 }, points: { size: 5 } },
        scales: { x: { time: false, ...log, range: (_, low, high) => [low, high] }, y: { ...log, range: logarithmic ? decades : range } },
        series: [
          { label: `${symbol} / ${unit}`, value: (_, v) => (logarithmic || v === null ? shown(v) : v.toFixed(2)) },
          ...group.map((i) => ({
            stroke: color(LOOKS[names[i]].color),
            width: LOOKS[names[i]].width,
            dash: LOOKS[names[i]].dash,
            spanGaps: logarithmic,
            label: names[i],
            points: { show: false },
            value: (_, v) => shown(v),
          })),
        ],
        axes: [
          { ...axis, label: ends && last ? `${along} / ${unit}` : undefined, size: !ends ? 6 : last ? 34 : 24, ...(ends ? {} : { values: () => [], ticks: { show: false } }) },
          { ...axis, label: residual ? "residual" : `${channel.name} / ${tidy(channel.unit)}`, size: 62, ...(residual ? { space: 24 } : {}) },
        ],
        hooks: { drawClear: [under], draw: [(plot) => over(plot, limit)], setCursor: [(plot) => read(plot.cursor.idx)] },
      }, [t, ...group.map((i) => all[i])], box);
      plot.channel = channel;
      plot.measured = 1 + group.findIndex((i) => names[i] === "measured");
      wheel(plot);
      return plot;
    };

    const show = () => {
      const found = views.find((v) => v.recording === recordings.select.value && v.choice === choices.select.value);
      plots.forEach((plot) => plot.destroy());
      plots = [];
      mark = null;
      read(null);
      view = found || null;
      notes.textContent = "";
      if (!view) {
        notes.textContent = "Not in this page; see the tables.";
        return;
      }
      const t = view.places ? powers(view.places) : unpack(view.channels[0].curves[0]).map((_, i) => view.t0 + i * view.step);
      if (view.bin_s !== null) notes.textContent = `Each pair of points is the least and greatest value in ${view.bin_s.toPrecision(3)} s.`;
      plots = view.channels.flatMap((channel, i) => make(channel, t, i === view.channels.length - 1));
    };

    const recordings = chooser("Recording", unique("recording"), show);
    const choices = chooser(choosing, unique("choice"), show);
    const all = element("button", "See all");
    const notes = element("span", "", "hint");
    all.type = "button";
    all.addEventListener("click", () => plots.length && zoom(plots[0].data[0][0], plots[0].data[0].at(-1)));
    const jumps = shortcuts.map(([name, choice]) => {
      const jump = element("button", name);
      jump.type = "button";
      jump.addEventListener("click", () => {
        choices.select.value = choice;
        show();
      });
      return jump;
    });
    // Of the width that is shown: where its ends go.
    const KEYS = { ArrowLeft: [-0.2, -0.2], ArrowRight: [0.2, 0.2], "+": [0.2, -0.2], "=": [0.2, -0.2], "-": [-0.3, 0.3] };
    box.addEventListener("keydown", (event) => {
      if (!plots.length || event.ctrlKey || event.metaKey || event.altKey) return;
      if (event.key === "0") return void all.click();
      if (!(event.key in KEYS)) return;
      event.preventDefault();
      const t = plots[0].data[0];
      const { min, max } = plots[0].scales.x;
      const [first, end, left, right] = [t[0], t.at(-1), min, max].map(scale);
      let [low, high] = KEYS[event.key].map((part, i) => [left, right][i] + part * (right - left));
      if (low < first) [low, high] = [first, high - low + first];
      if (high > end) [low, high] = [Math.max(first, low - high + end), end];
      zoom(Math.max(t[0], back(low)), Math.min(t.at(-1), back(high)));
    });
    root.querySelector(".choices").append(recordings.frame, choices.frame, all, ...jumps, notes);
    root.hidden = false;
    root.parentElement.classList.add("live-on");
    show();
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", show);
    new ResizeObserver(() => plots.forEach((plot) => plot.setSize({ width: box.clientWidth, height: plot.height }))).observe(box);
  }

  // A figure is drawn when it comes near the window, so that the page opens at once.
  const watcher = new IntersectionObserver((entries) => entries.filter((entry) => entry.isIntersecting).forEach((entry) => {
    watcher.unobserve(entry.target);
    figure(entry.target.querySelector(".live"));
  }), { rootMargin: "600px" });
  document.querySelectorAll(".live").forEach((root) => watcher.observe(root.parentElement));

  // Every table can be taken along as CSV, with its numbers as a program reads them.
  const plain = (text) => {
    const told = text.trim().replaceAll("\u00a0", " ").replaceAll("−", "-");
    const digits = { "⁻": "-", "⁰": "0", "¹": "1", "²": "2", "³": "3", "⁴": "4", "⁵": "5", "⁶": "6", "⁷": "7", "⁸": "8", "⁹": "9" };
    const number = told.replace(/ × 10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)/g, (_, power) => `e${[...power].map((letter) => digits[letter]).join("")}`);
    return /[",\n]/.test(number) ? `"${number.replaceAll('"', '""')}"` : number;
  };
  document.querySelectorAll(".grid table").forEach((table) => {
    const title = document.getElementById(table.getAttribute("aria-labelledby"));
    const save = element("button", "CSV", "save");
    save.type = "button";
    save.title = "Save this table as CSV";
    save.addEventListener("click", () => {
      const lines = [...table.rows].map((row) => [...row.cells].map((cell) => plain(cell.textContent)).join(","));
      const link = element("a");
      link.href = URL.createObjectURL(new Blob([lines.join("\r\n"), "\r\n"], { type: "text/csv" }));
      link.download = `${title.id}.csv`;
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 1000);
    });
    title.append(" ", save);
  });

  addEventListener("beforeprint", () => document.querySelectorAll("details").forEach((fold) => { fold.open = true; }));
})();
