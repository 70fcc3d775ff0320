// A section for each experiment, one for the episodes, one for what was wrong with the folder.
"use strict";

/** What is worth showing first of the experiments that are known; others show all columns and plot what has intervals. */
const VIEWS = {
  "table1-plug": { title: "Table I · solvers on the plug", columns: ["row", "setting", "problems", "attempts", "success_percent", "relative_speedup_cpu", "relative_speedup_expansions", "relative_cost_to_base", "cost_to_certified", "cpu_s", "expansions"], dots: ["success_percent", "relative_speedup_cpu", "relative_cost_to_base"], log: ["relative_speedup_cpu"] },
  "table4-pipe": { title: "Table IV · solvers on the pipe", columns: ["row", "setting", "problems", "attempts", "success_percent", "relative_speedup_cpu", "relative_speedup_expansions", "relative_cost_to_base", "cost_to_certified", "cpu_s", "expansions"], dots: ["success_percent", "relative_speedup_cpu", "relative_cost_to_base"], log: ["relative_speedup_cpu"] },
  "table3-ablation": { title: "Table III · experience and order", columns: ["row", "setting", "problems", "attempts", "success_percent", "relative_speedup_cpu", "relative_speedup_expansions", "relative_cost_to_base", "cost_to_certified", "cpu_s"], dots: ["success_percent", "relative_speedup_cpu", "relative_cost_to_base"], log: ["relative_speedup_cpu"] },
  "table2-framework": { title: "Table II · the whole framework", columns: ["row", "episodes", "rate", "time_median_s", "path_median_m", "force_median_n", "contacts_mean", "moves_mean", "plan_cpu_mean_s", "ladder_use", "rejected_placements"], dots: ["rate", "time_median_s"] },
  "figure-tbl": { title: "Cost and planning time against touch-based localization", columns: ["cost", "hypotheses", "policy", "walks", "localized", "cost_mean", "relative_cost", "plan_cpu_s", "moves_mean", "contacts_mean"] },
  "acceptance-closed-loop": { title: "The closed loop in physics", columns: ["row", "size", "episodes", "inserted", "rate", "required", "ladder_use", "time_mean_s", "time_max_s", "error_p50_mm", "error_p95_mm", "moves", "contacts", "peak_force_n"], dots: ["rate"], judged: "required" },
  bounds: { title: "Bounds of the certified solver over time", lines: { x: "time_s", y: "ratio", by: ["opening", "extents"], x_log: true, y_log: true, y_label: "upper / lower bound" }, collapse: true },
  baselines: { title: "Baselines over the same episodes", columns: ["task", "policy", "uncertainty_mm", "episodes", "rate", "time_median_s", "path_median_m", "force_median_n", "contacts_mean", "plan_cpu_mean_s", "ladder_use"] },
  noise: { title: "What breaks first", columns: ["noise", "level", "unit", "policy", "episodes", "rate", "time_median_s", "path_median_m", "force_median_n", "contacts_mean", "ladder_use"] },
  "spiral-tuning": { title: "How the spiral was tuned", columns: ["task", "pitch_mm", "speed_mm_s", "force_n", "episodes", "rate", "time_median_s", "force_median_n"] },
  "acceptance-guarded-moves": { title: "Guarded moves against geometry" },
  "acceptance-transfers": { title: "Transfers among obstacles" },
};

const Sections = {
  title(experiment) { return (VIEWS[experiment.name] || {}).title || experiment.details.title || experiment.name; },

  anchor(experiment) { return "x-" + (experiment.folder + "-" + experiment.name).replace(/[^A-Za-z0-9]+/g, "-").replace(/^-/, ""); },

  figures(experiment, view) {
    const made = experiment.figures.map((f) => Plots.lines(f)).filter(Boolean);
    if (made.length) return made;
    if (view.lines) {
      const at = (name) => experiment.columns.indexOf(name), groups = new Map();
      if (at(view.lines.x) >= 0 && at(view.lines.y) >= 0) {
        for (const row of experiment.rows) {
          const name = view.lines.by.map((c) => row[at(c)]).join(" ");
          if (!groups.has(name)) groups.set(name, []);
          groups.get(name).push({ x: row[at(view.lines.x)], y: row[at(view.lines.y)] });
        }
        const byFirst = d3.nest().key((n) => n.split(" ")[0]).entries([...groups.keys()]);
        return byFirst.map((g) => Plots.lines({ ...view.lines, title: g.key, x_label: Format.column(view.lines.x), series: g.values.map((n) => ({ name: n, points: groups.get(n) })) })).filter(Boolean);
      }
    }
    const plan = Tables.markShares(Tables.plan(experiment.columns.map(String)), experiment.rows), labels = Tables.labels(experiment);
    const worth = plan.filter((c) => (view.dots ? view.dots.includes(c.name) : c.low !== undefined || c.printed !== undefined)).slice(0, 4);
    // Parts of a row stand in the table; the plot has what is judged.
    const judged = experiment.columns.indexOf(view.judged), plotted = (row) => judged < 0 || row[judged] !== null;
    if (experiment.rows.filter(plotted).length > 60) return [];
    return worth.map((cell) => {
      const scale = cell.share ? 100 : 1, known = (v) => (typeof v === "number" ? scale * v : null);
      const rows = experiment.rows.map((row, k) => ({ row, label: labels[k], marks: [{ value: known(row[cell.index]), low: known(row[cell.low]), high: known(row[cell.high]), color: "var(--accent)" },
        ...(cell.printed !== undefined && typeof row[cell.printed] === "number" ? [{ value: known(Tables.printed(cell, row)), printed: true }] : [])].filter((m) => m.value !== null) })).filter((r) => r.marks.length && plotted(r.row));
      if (!rows.length) return null;
      const printed = rows.some((r) => r.marks.some((m) => m.printed));
      const isPercent = cell.share || /percent/.test(cell.name);
      return Plots.dots(Format.column(cell.name).replace(/, %$/, ""), null, rows, { label: isPercent ? "%" : (view.log || []).includes(cell.name) ? "logarithmic" : "", log: (view.log || []).includes(cell.name), to: isPercent ? 100 : undefined, from: isPercent ? 90 : undefined,
        legend: printed ? [{ name: "measured" + (cell.low !== undefined ? ", 95 % interval" : ""), color: "var(--accent)" }, { name: "printed in the paper", hollow: true }] : null });
    }).filter(Boolean);
  },

  provenance(experiment) {
    const m = experiment.manifest;
    if (!m) return element("p", { class: "note" }, "These results do not say where they came from.");
    const machine = m.machine || {};
    const entries = [["version", m.version], ["seeds", (m.seeds || []).join(", ")], ["machine", [machine.processor, machine.cores && machine.cores + " cores", machine.memory_bytes && (machine.memory_bytes / 2 ** 30).toFixed(0) + " GiB", machine.system].filter(Boolean).join(", ")], ["files", `${experiment.folder ? experiment.folder + "/" : ""}${experiment.name}.csv, .json`]];
    return element("details", { class: "provenance" }, element("summary", {}, "Where this comes from, and how to run it again"),
      element("pre", {}, m.command || "(no command recorded)"), element("dl", {}, entries.flatMap(([k, v]) => [element("dt", {}, k), element("dd", {}, v || "–")])),
      element("details", { class: "more" }, element("summary", {}, "all settings"), element("pre", { class: "settings" }, JSON.stringify(m.settings, null, 1))));
  },

  experiment(experiment, version) {
    const view = VIEWS[experiment.name] || {};
    const section = element("section", { class: "experiment", id: Sections.anchor(experiment) }, element("h2", {}, Sections.title(experiment)), element("p", { class: "soft" }, experiment.name + (experiment.folder ? ` in ${experiment.folder}` : ""),
      view.title && experiment.details.title ? ` — ${experiment.details.title}` : ""));
    if (experiment.manifest && experiment.manifest.version !== version) section.append(element("p", { class: "note" }, `Made by version ${experiment.manifest.version}; this page by ${version}.`));
    if (experiment.manifest && experiment.manifest.settings && experiment.manifest.settings.quick) section.append(element("p", { class: "note" }, "Quick size: shows that everything works; the figures are no results."));
    const figures = Sections.figures(experiment, view);
    const wide = view.columns && Tables.plan(experiment.columns.map(String)).length > view.columns.length;
    const holder = element("div", {}, Tables.build(experiment, view.columns));
    if (figures.length) section.append(element("div", { class: "figures" }, figures));
    const tall = view.collapse || experiment.rows.length > 40;
    const all = wide ? element("button", { type: "button", class: "chip more", "aria-pressed": "false", onclick: (e) => {
      const on = e.target.getAttribute("aria-pressed") !== "true";
      e.target.setAttribute("aria-pressed", String(on));
      holder.replaceChildren(Tables.build(experiment, on ? null : view.columns));
    } }, "all columns") : null;
    section.append(tall ? element("details", {}, element("summary", {}, `the table, ${experiment.rows.length} rows`), all, holder) : element("div", {}, holder, all));
    if (experiment.pictures.length) section.append(element("div", { class: "figures" }, experiment.pictures.map((p) => element("figure", {}, element("img", { src: p.source, alt: p.caption || "", loading: "lazy" }), element("figcaption", {}, p.caption || "")))));
    if (experiment.details.failures) {
      section.append(element("details", {}, element("summary", {}, "failures of each row"), element("ul", {}, experiment.details.failures.map((f) => element("li", {}, `${f.row}${f.size ? " " + f.size : ""}: `, Object.entries(f.failures).map(([reason, n]) => `${n} × ${reason}`).join("; "))))));
    }
    section.append(Sections.provenance(experiment));
    return section;
  },

  /** "insertion: stopped after 0.02 of 18 mm" counts as "insertion: stopped after". */
  kindOfReason(reason) { return reason.split(/\s*[-+(]?\d/)[0] || reason; },

  episodes(section, data, go) {
    if (!data.records.length) return;
    const total = data.records.reduce((n, r) => n + r.episodes.length, 0), replays = data.records.reduce((n, r) => n + r.episodes.filter((e) => e.replay >= 0).length, 0);
    section.append(element("h2", {}, "Episodes"), element("p", { class: "soft" }, `${total.toLocaleString("en-US")} episodes in ${data.records.length} file${data.records.length > 1 ? "s" : ""}; ${replays.toLocaleString("en-US")} have a replay in this page` + (replays < total ? " (failures first, then episodes that needed fallbacks, then some of every run)." : ".")));
    const rows = data.records.map((run) => ({ label: run.label, points: run.episodes.map((e) => ({ x: e.time_s, good: e.inserted, title: `episode ${e.episode}: ${e.reason}, ${e.time_s.toFixed(2)} s${e.replay >= 0 ? " (click for the replay)" : ""}`, go: e.replay >= 0 ? () => go(e.replay) : null })) }));
    const printed = [...new Set(data.records.map((r) => Summary.printedTask(data, r.task)).filter(Boolean))];
    if (rows.length <= 60) {
      section.append(Plots.strips("Seconds on the robot", "a dot an episode, a bar the median of the inserted ones", rows, { label: "simulated seconds from the start pose to the verdict", marks: printed.map((p) => ({ x: p[2], label: `paper, ${p[0].split(" ")[0]}: ${p[2]} s` })),
        legend: [{ name: "inserted", color: "var(--accent)" }, { name: "failed", color: "var(--bad)" }] }));
    }
    const columns = ["run", "seed", "episodes", "inserted_rate", "inserted_low", "inserted_high", "time_median_s", "time_p95_s", "error_median_mm", "path_mean_m", "contacts_mean", "peak_force_n", "fallbacks_rate", "plan_cpu_ms"];
    const table = data.records.map((run) => {
      const rate = Summary.rate(run.episodes), good = run.episodes.filter((e) => e.inserted), all = run.episodes;
      return [run.label, run.seed, all.length, rate.value, rate.low, rate.high, Summary.time(all), Statistics.quantile(good.map((e) => e.time_s), 0.95), Statistics.quantile(all.map((e) => e.error_mm), 0.5), Statistics.mean(all.map((e) => e.path_m)), Statistics.mean(all.map((e) => e.contacts)), Math.max(...all.map((e) => e.force_n)),
        all.filter((e) => e.rungs > 0).length / all.length, 1e3 * Statistics.mean(all.map((e) => e.plan_s))];
    });
    const build = Tables.build({ columns, rows: table });
    section.append(data.records.length > 30 ? element("details", {}, element("summary", {}, `the table, ${table.length} runs`), build) : build);
    Sections.failures(section, data, go);
  },

  failures(section, data, go) {
    const kinds = new Map();
    for (const run of data.records) {
      for (const e of run.episodes.filter((one) => !one.inserted)) {
        const key = run.label + "|" + Sections.kindOfReason(e.reason);
        if (!kinds.has(key)) kinds.set(key, { run: run.label, reason: Sections.kindOfReason(e.reason), episodes: [] });
        kinds.get(key).episodes.push(e);
      }
    }
    section.append(element("h3", { id: "failures" }, "Failures and their reasons"));
    if (!kinds.size) { section.append(element("p", {}, "No episode failed.")); return; }
    const most = 12;
    const chip = (e) => (e.replay >= 0 ? element("button", { type: "button", class: "chip", title: e.reason, onclick: () => go(e.replay) }, e.episode) : element("span", { class: "chip soft", title: e.reason }, e.episode));
    const body = [...kinds.values()].sort((a, b) => b.episodes.length - a.episodes.length).map((k) => element("tr", {}, element("td", { class: "text" }, k.run), element("td", {}, k.episodes.length), element("td", { class: "text wrap" }, k.reason, k.episodes[0].reason !== k.reason ? element("div", { class: "soft" }, "e.g. " + k.episodes[0].reason) : null),
      element("td", { class: "text wrap" }, element("div", { class: "chips" }, k.episodes.slice(0, most).map(chip), k.episodes.length > most ? element("span", { class: "soft" }, `and ${k.episodes.length - most} more`) : null))));
    section.append(element("div", { class: "scroll" }, element("table", {}, element("thead", {}, element("tr", {}, element("th", {}, "run"), element("th", {}, "episodes"), element("th", { class: "text" }, "reason"), element("th", { class: "text" }, "which (a button opens the replay)"))), element("tbody", {}, body))));
  },

  faults(section, data) {
    if (!data.faults.length) return;
    section.append(element("h2", {}, "Faults in the folder"), element("p", { class: "soft" }, "What could not be used, or not as it stands. Everything else is reported above."),
      element("div", { class: "scroll" }, element("table", {}, element("thead", {}, element("tr", {}, element("th", { class: "text" }, "where"), element("th", { class: "text" }, "what"), element("th", { class: "text" }, "how to mend"))),
        element("tbody", {}, data.faults.map((f) => element("tr", {}, f.map((text) => element("td", { class: "text wrap" }, text))))))));
  },
};
