// Plots as vector graphics, drawn by d3 to the width that there is.
"use strict";

const Plots = {
  colors: ["var(--accent)", "var(--contact)", "var(--second)", "var(--good)", "#8c6d1f", "#b03a6b", "#4a6fd0", "#6b6b6b"],
  drawn: 0,

  /** A figure whose drawing follows the width; `draw(svg, width)` returns the height. */
  figure(title, note, draw, legend) {
    const holder = element("div", { class: "plot" });
    const figure = element("figure", {}, title ? element("figcaption", {}, title, note ? element("span", { class: "soft" }, " — " + note) : null) : null, holder, legend || null);
    let width = 0;
    const redraw = () => {
      const now = Math.max(260, Math.round(holder.clientWidth || 460));
      if (Math.abs(now - width) < 4) return;
      width = now;
      holder.textContent = "";
      const svg = d3.select(holder).append("svg").attr("role", "img").attr("aria-label", title || "plot");
      const height = draw(svg, width);
      svg.attr("viewBox", `0 0 ${width} ${height}`);
      Plots.drawn += 1;
    };
    new ResizeObserver(() => requestAnimationFrame(redraw)).observe(holder);
    return figure;
  },

  legend(entries) {
    return element("div", { class: "legend" }, entries.map((e) =>
      element("span", {}, element("i", { class: e.hollow ? "hollow" : null, style: e.hollow ? null : `background:${e.color}` }), e.name)));
  },

  ticks(scale, log, count) {
    if (!log) return scale.ticks(count);
    const [low, high] = scale.domain();
    const all = scale.ticks();
    const tens = all.filter((v) => Math.abs(Math.log10(v) - Math.round(Math.log10(v))) < 1e-9);
    if (tens.length >= 3) return tens;
    return all.filter((v) => { const lead = v / Math.pow(10, Math.floor(Math.log10(v) + 1e-9)); return [1, 2, 5].some((l) => Math.abs(lead - l) < 1e-6); })
      .filter((v) => v >= low && v <= high);
  },

  /** rows: [{label, marks: [{value, low, high, color, printed}]}]; one line a row. */
  dots(title, note, rows, options) {
    const legend = options.legend ? Plots.legend(options.legend) : null;
    return Plots.figure(title, note, (svg, width) => {
      const widest = d3.max(rows, (r) => r.label.length);
      const left = Math.min(width * 0.44, 12 + widest * 6.4), right = 14, top = 6, step = 22;
      const height = top + rows.length * step + 40;
      const values = rows.flatMap((r) => r.marks.flatMap((m) => [m.value, m.low, m.high])).filter((v) => v !== null && v !== undefined && isFinite(v) && (!options.log || v > 0));
      let [low, high] = d3.extent(values);
      if (options.from !== undefined) low = Math.min(low, options.from);
      if (options.to !== undefined) high = Math.max(high, options.to);
      if (low === high) { low -= Math.abs(low) * 0.1 || 1; high += Math.abs(high) * 0.1 || 1; }
      const x = (options.log ? d3.scaleLog() : d3.scaleLinear()).domain([low, high]).nice().range([left, width - right]);
      const bottom = top + rows.length * step;
      svg.append("g").attr("class", "grid").attr("transform", `translate(0,${bottom})`)
        .call(d3.axisBottom(x).tickValues(Plots.ticks(x, options.log, width < 420 ? 4 : 6)).tickSize(-(bottom - top)).tickFormat(Format.tick));
      svg.append("text").attr("class", "axis-label").attr("x", (left + width - right) / 2).attr("y", bottom + 33).attr("text-anchor", "middle").text(options.label || "");
      rows.forEach((row, i) => {
        const y = top + (i + 0.5) * step, g = svg.append("g");
        const room = Math.floor(left / 6.2);
        g.append("text").attr("x", left - 10).attr("y", y).attr("dy", "0.34em").attr("text-anchor", "end")
          .text(row.label.length > room ? row.label.slice(0, room - 1) + "…" : row.label).append("title").text(row.label);
        row.marks.forEach((mark, j) => {
          if (mark.value === null || mark.value === undefined || options.log && mark.value <= 0) return;
          const at = y + (row.marks.length > 2 ? (j - (row.marks.length - 1) / 2) * 4 : 0);
          if (mark.low !== undefined && mark.low !== null && mark.high !== null) {
            g.append("line").attr("class", "interval").attr("stroke", mark.color).attr("x1", x(options.log ? Math.max(mark.low, x.domain()[0]) : mark.low)).attr("x2", x(mark.high)).attr("y1", at).attr("y2", at);
          }
          const dot = mark.printed
            ? g.append("path").attr("class", "printed-mark").attr("d", d3.symbol().type(d3.symbolDiamond).size(64)()).attr("transform", `translate(${x(mark.value)},${at})`)
            : g.append("circle").attr("class", "dot").attr("cx", x(mark.value)).attr("cy", at).attr("r", 4.5).attr("fill", mark.color);
          dot.append("title").text(`${row.label}: ${Format.number(mark.value)}${mark.low !== undefined && mark.low !== null ? ` [${Format.number(mark.low)}, ${Format.number(mark.high)}]` : ""}${mark.printed ? " (printed)" : ""}`);
        });
      });
      return height;
    }, legend);
  },

  /** {title, x_label, y_label, x_log, y_log, series: [{name, printed, points: [{x, y, low, high}]}]} */
  lines(spec) {
    // "NAME, printed" is the printed value beside NAME: a dotted line of its colour.
    const of = (s) => s.name.replace(/, printed$/, "");
    const names = [...new Set(spec.series.map(of))];
    const series = spec.series.map((s) => {
      const i = names.indexOf(of(s)), printed = of(s) !== s.name;
      return { ...s, printed, color: Plots.colors[i % Plots.colors.length], dash: printed ? "1 4" : i >= Plots.colors.length ? "5 3" : null,
        points: s.points.filter((p) => p.y !== null && isFinite(p.y) && (!spec.x_log || p.x > 0) && (!spec.y_log || p.y > 0)).sort((a, b) => a.x - b.x) };
    }).filter((s) => s.points.length);
    if (!series.length) return null;
    const legend = Plots.legend(series.filter((s) => !s.printed).map((s) => ({ name: s.name, color: s.color }))
      .concat(series.some((s) => s.printed) ? [{ name: "dotted: printed", color: "var(--printed)" }] : []));
    return Plots.figure(spec.title, spec.note, (svg, width) => {
      const height = Math.round(Math.min(340, Math.max(230, width * 0.6)));
      const left = 52, right = 14, top = 10, bottom = height - 42;
      const xs = series.flatMap((s) => s.points.map((p) => p.x));
      const ys = series.flatMap((s) => s.points.flatMap((p) => [p.y, p.low, p.high])).filter((v) => v !== null && v !== undefined && isFinite(v) && (!spec.y_log || v > 0));
      const widen = ([a, b], log) => (a === b ? (log ? [a / 2, b * 2] : [a - 1, b + 1]) : [a, b]);
      const x = (spec.x_log ? d3.scaleLog() : d3.scaleLinear()).domain(widen(d3.extent(xs), spec.x_log)).range([left, width - right]);
      const y = (spec.y_log ? d3.scaleLog() : d3.scaleLinear()).domain(widen(d3.extent(spec.y_log ? ys : ys.concat(spec.y_from_zero === false ? [] : d3.min(ys) > 0 && d3.min(ys) < 0.5 * d3.max(ys) ? [0] : [])), spec.y_log)).nice().range([bottom, top]);
      svg.append("g").attr("class", "grid").attr("transform", `translate(${left},0)`)
        .call(d3.axisLeft(y).tickValues(Plots.ticks(y, spec.y_log, 5)).tickSize(-(width - left - right)).tickFormat(Format.tick));
      svg.append("g").attr("transform", `translate(0,${bottom})`)
        .call(d3.axisBottom(x).tickValues(Plots.ticks(x, spec.x_log, width < 420 ? 4 : 7)).tickFormat(Format.tick));
      svg.append("text").attr("class", "axis-label").attr("x", (left + width - right) / 2).attr("y", height - 6).attr("text-anchor", "middle").text(spec.x_label || "");
      svg.append("text").attr("class", "axis-label").attr("transform", `translate(12,${(top + bottom) / 2}) rotate(-90)`).attr("text-anchor", "middle").text(spec.y_label || "");
      const clampY = (v) => y(spec.y_log ? Math.max(v, y.domain()[0]) : v);
      for (const s of series) {
        const banded = s.points.filter((p) => p.low !== undefined && p.low !== null && p.high !== undefined && p.high !== null);
        if (banded.length > 1) {
          svg.append("path").attr("class", "band").attr("fill", s.color).attr("d", d3.area().x((p) => x(p.x)).y0((p) => clampY(p.low)).y1((p) => clampY(p.high))(banded));
        }
        svg.append("path").attr("class", "line").attr("stroke", s.color).attr("stroke-dasharray", s.dash).attr("d", d3.line().x((p) => x(p.x)).y((p) => y(p.y))(s.points));
        if (s.points.length <= 16 && !s.printed) {
          for (const p of s.points) {
            if (banded.length) svg.append("line").attr("class", "interval").attr("stroke", s.color).attr("x1", x(p.x)).attr("x2", x(p.x)).attr("y1", clampY(p.low ?? p.y)).attr("y2", clampY(p.high ?? p.y));
            svg.append("circle").attr("class", "dot").attr("cx", x(p.x)).attr("cy", y(p.y)).attr("r", 3.4).attr("fill", s.color)
              .append("title").text(`${s.name}: ${Format.number(p.x)}, ${Format.number(p.y)}`);
          }
        }
      }
      return height;
    }, legend);
  },

  /** rows: [{label, points: [{x, good, title, go}]}], marks: [{x, label}]; one dot an episode. */
  strips(title, note, rows, options) {
    return Plots.figure(title, note, (svg, width) => {
      const widest = d3.max(rows, (r) => r.label.length);
      const left = Math.min(width * 0.4, 12 + widest * 6.4), right = 14, top = options.marks.length ? 20 : 6, step = 30;
      const bottom = top + rows.length * step, height = bottom + 40;
      const xs = rows.flatMap((r) => r.points.map((p) => p.x)).concat(options.marks.map((m) => m.x));
      const x = d3.scaleLinear().domain([0, d3.max(xs) || 1]).nice().range([left, width - right]);
      svg.append("g").attr("class", "grid").attr("transform", `translate(0,${bottom})`).call(d3.axisBottom(x).ticks(6).tickSize(-(bottom - top)).tickFormat(Format.tick));
      svg.append("text").attr("class", "axis-label").attr("x", (left + width - right) / 2).attr("y", bottom + 33).attr("text-anchor", "middle").text(options.label);
      for (const mark of options.marks) {
        svg.append("line").attr("x1", x(mark.x)).attr("x2", x(mark.x)).attr("y1", top).attr("y2", bottom).attr("stroke", "var(--printed)").attr("stroke-dasharray", "4 3");
        svg.append("text").attr("x", x(mark.x)).attr("y", 12).attr("text-anchor", x(mark.x) > width * 0.75 ? "end" : "middle").style("fill", "var(--printed)").style("font-size", "11px").text(mark.label);
      }
      rows.forEach((row, i) => {
        const y = top + (i + 0.5) * step, room = Math.floor(left / 6.2);
        svg.append("text").attr("x", left - 10).attr("y", y).attr("dy", "0.34em").attr("text-anchor", "end")
          .text(row.label.length > room ? row.label.slice(0, room - 1) + "…" : row.label).append("title").text(row.label);
        const every = Math.max(1, Math.ceil(row.points.length / 300));
        row.points.forEach((p, k) => {
          if (p.good && k % every) return;
          const dot = svg.append("circle").attr("class", "strip dot" + (p.go ? " link" : "")).attr("cx", x(p.x)).attr("cy", y + ((k * 7) % 13 - 6)).attr("r", p.good ? 3 : 4.2)
            .attr("fill", p.good ? "var(--accent)" : "var(--bad)");
          dot.append("title").text(p.title);
          if (p.go) dot.on("click", p.go);
        });
        const median = Statistics.quantile(row.points.filter((p) => p.good).map((p) => p.x), 0.5);
        if (median !== null) svg.append("line").attr("x1", x(median)).attr("x2", x(median)).attr("y1", y - 11).attr("y2", y + 11).attr("stroke", "var(--ink)").attr("stroke-width", 2).append("title").text("median " + Format.number(median));
      });
      return height;
    }, options.legend ? Plots.legend(options.legend) : null);
  },
};
