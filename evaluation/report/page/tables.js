// Tables of experiments: intervals stand with their value, printed values beside the measured ones.
"use strict";

const Tables = {
  /** What of a table is a value, an interval of one, or its printed partner: [{name, index, low, high, printed, share}]. */
  plan(columns) {
    const at = new Map(columns.map((name, i) => [name, i]));
    const cells = columns.map((name, index) => ({ name, index, share: false }));
    const isBound = (name) => /(^|_)(low|high)(_|$)/.test(name) || name.startsWith("printed");
    // "time_low_s" belongs to "time_s", else to the first column that begins and ends like it: "time_median_s".
    const owner = (name) => {
      const words = name.split("_").filter((w) => w !== "low" && w !== "high"), base = words.join("_");
      if (at.has(base)) return at.get(base);
      if (base === "") return ["rate", "value"].map((known) => at.get(known)).find((i) => i !== undefined) ?? -1;
      const last = words.length > 1 ? words[words.length - 1] : null;
      return columns.findIndex((c) => !isBound(c) && c.startsWith(words[0] + "_") && (last === null || c.endsWith("_" + last)));
    };
    const printedAs = { success_percent: ["rate", 0.01], execution_time_s: ["time_median_s", 1] };
    const hidden = new Set();
    columns.forEach((name, index) => {
      const bound = /(^|_)(low|high)(_|$)/.exec(name);
      if (bound && !name.startsWith("printed")) {
        const of = owner(name);
        if (of >= 0) { cells[of][bound[2]] = index; hidden.add(index); }
      } else if (name.startsWith("printed_")) {
        const base = name.slice("printed_".length);
        let of = columns.findIndex((c) => c === base);
        if (of < 0) of = columns.findIndex((c, i) => !isBound(c) && !hidden.has(i) && c.startsWith(base));
        let scale = 1;
        if (of < 0 && printedAs[base] && at.has(printedAs[base][0])) [of, scale] = [at.get(printedAs[base][0]), printedAs[base][1]];
        if (of >= 0 && cells[of].printed === undefined) { Object.assign(cells[of], { printed: index, printedScale: scale }); hidden.add(index); }
      }
    });
    return cells.filter((c) => !hidden.has(c.index));
  },

  /** Shares are shown in percent where the whole column lies in 0..1 and its name says so. */
  markShares(plan, rows) {
    for (const cell of plan) {
      if (!Format.isShare(cell.name)) continue;
      const values = rows.map((r) => r[cell.index]).filter((v) => typeof v === "number");
      cell.share = values.length > 0 && values.every((v) => v >= 0 && v <= 1);
    }
    return plan;
  },

  /** What the paper prints for a cell, in the unit of the column. */
  printed(cell, row) {
    const value = row[cell.printed];
    return typeof value === "number" ? value * cell.printedScale : value;
  },

  text(value, share) {
    if (typeof value === "boolean") return value ? "yes" : "no";
    if (value !== null && typeof value === "object") return JSON.stringify(value);
    return share && typeof value === "number" ? Format.percent(value) : Format.number(value);
  },

  /** `columns`: names to show, in order; none: all. */
  build(experiment, columns) {
    const plan = Tables.markShares(Tables.plan(experiment.columns.map(String)), experiment.rows);
    const shown = columns ? columns.map((name) => plan.find((c) => c.name === name)).filter(Boolean) : plan;
    const isText = (cell) => experiment.rows.every((r) => typeof r[cell.index] !== "number");
    const anyPrinted = (cell) => cell.printed !== undefined && experiment.rows.some((r) => r[cell.printed] !== null);
    const head = element("tr", {}), body = element("tbody");
    for (const cell of shown) {
      cell.text = isText(cell);
      cell.withPrinted = anyPrinted(cell);
      head.append(element("th", { class: cell.text ? "text" : null, scope: "col" }, Format.column(cell.name) + (cell.share ? ", %" : "")));
      if (cell.withPrinted) head.append(element("th", { class: "printed", scope: "col" }, "printed"));
    }
    for (const row of experiment.rows) {
      const line = element("tr");
      for (const cell of shown) {
        const value = row[cell.index], low = row[cell.low], high = row[cell.high];
        const interval = value !== null && typeof low === "number" && typeof high === "number";
        line.append(element("td", { class: cell.text ? "text" : null }, Tables.text(value, cell.share),
          interval ? element("span", { class: "interval" }, `[${Tables.text(low, cell.share)}, ${Tables.text(high, cell.share)}]`) : null));
        if (cell.withPrinted) line.append(element("td", { class: "printed" }, row[cell.printed] === null ? "" : Tables.text(Tables.printed(cell, row), cell.share)));
      }
      body.append(line);
    }
    return element("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": "Table" }, element("table", {}, element("thead", {}, head), body));
  },

  /** What tells rows apart, in words. */
  labels(experiment) {
    const candidates = experiment.columns.map((name, i) => ({ name, i }))
      .filter(({ i, name }) => !String(name).startsWith("printed") && experiment.rows.every((r) => typeof r[i] === "string") && new Set(experiment.rows.map((r) => r[i])).size > 1);
    let chosen = [];
    const distinct = (columns) => new Set(experiment.rows.map((r) => columns.map((c) => r[c.i]).join("|"))).size;
    for (const candidate of candidates) if (distinct([...chosen, candidate]) > (chosen.length ? distinct(chosen) : 1)) chosen.push(candidate);
    if (chosen.length === 0 || distinct(chosen) < experiment.rows.length) {
      const number = experiment.columns.findIndex((name, i) => experiment.rows.every((r) => typeof r[i] === "number" && Number.isInteger(r[i])) && new Set(experiment.rows.map((r) => r[i])).size > 1);
      if (number >= 0 && distinct([...chosen, { i: number }]) > distinct(chosen)) chosen.push({ i: number, name: experiment.columns[number], number: true });
    }
    return experiment.rows.map((r, k) => chosen.map((c) => (c.number ? `${Format.column(c.name)} ${r[c.i]}` : r[c.i])).join(" · ") || `row ${k + 1}`);
  },
};
