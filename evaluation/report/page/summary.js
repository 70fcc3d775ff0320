// The first screen: what Feeler reaches, what the paper prints, what the baselines reach.
"use strict";

const Summary = {
  /** Episodes of the same task, policy and noise, over all files. */
  groups(records) {
    const groups = new Map();
    for (const run of records) {
      const key = [run.task, run.policy, run.noise].join("|");
      if (!groups.has(key)) groups.set(key, { task: run.task, policy: run.policy, noise: run.noise, episodes: [] });
      groups.get(key).episodes.push(...run.episodes);
    }
    return [...groups.values()];
  },

  rate(episodes) { return Statistics.wilson(episodes.filter((e) => e.inserted).length, episodes.length); },
  time(episodes) { return Statistics.quantile(episodes.filter((e) => e.inserted).map((e) => e.time_s), 0.5); },

  column(experiment, ...patterns) {
    for (const pattern of patterns) {
      const index = experiment.columns.findIndex((c) => pattern.test(c));
      if (index >= 0) return index;
    }
    return -1;
  },

  find(data, name) { return data.experiments.find((e) => e.name === name); },
  printedTask(data, task) { return data.paper.table2_framework.rows.find((r) => r[0].startsWith(task.startsWith("pipe") ? "pipe" : "plug")); },

  card(what, value, unit, interval, paper, baseline) {
    return element("div", { class: "card" }, element("div", { class: "what" }, what), element("div", { class: "value" }, value, unit ? element("small", {}, " " + unit) : null),
      element("div", { class: "interval" }, interval || "\u00a0"), paper ? element("div", { class: "paper" }, "the paper: ", element("b", {}, paper)) : null,
      (baseline || []).map((text) => element("div", { class: "baseline" }, text)));
  },

  percentText(rate) { return `95 % interval ${Format.percent(rate.low)} to ${Format.percent(rate.high)}, ${rate.successes} of ${rate.trials}`; },

  /** Success and time of a task: from table2-framework, else from the records. */
  taskCards(data, groups) {
    const cards = [], framework = Summary.find(data, "table2-framework");
    const ours = [];
    if (framework) {
      const c = (...p) => Summary.column(framework, ...p);
      const task = c(/^task$/, /task/), rate = c(/^inserted_rate$/, /^rate$/, /^success(_rate)?$/, /success.*percent/, /rate/), time = c(/time.*median/, /median.*s$/, /time/);
      const plan = Tables.plan(framework.columns.map(String)).find((p) => p.index === rate) || {};
      for (const row of framework.rows) {
        const scale = /percent/.test(framework.columns[rate] || "") ? 0.01 : 1;
        if (rate < 0 || typeof row[rate] !== "number") continue;
        ours.push({ task: String(row[task] ?? "plug"), value: scale * row[rate], low: plan.low !== undefined ? scale * row[plan.low] : null, high: plan.high !== undefined ? scale * row[plan.high] : null, time: time >= 0 ? row[time] : null, note: "table2-framework" });
      }
    }
    if (!ours.length) {
      for (const g of groups.filter((g) => g.policy === "database" && g.noise === "ideal")) {
        const rate = Summary.rate(g.episodes);
        ours.push({ task: g.task, value: rate.value, low: rate.low, high: rate.high, time: Summary.time(g.episodes), note: `${rate.successes} of ${rate.trials} episodes` });
      }
      ours.sort((a, b) => (a.task === "plug" ? -1 : b.task === "plug" ? 1 : 0));
    }
    for (const own of ours.slice(0, 2)) {
      const printed = Summary.printedTask(data, own.task);
      const others = groups.filter((g) => g.task === own.task && g.policy !== "database" && g.noise === "ideal");
      cards.push(Summary.card(`${own.task}: inserted`, Format.percent(own.value), "%", (own.low !== null ? `95 % interval ${Format.percent(own.low)} to ${Format.percent(own.high)}` : "") + (own.note ? ` · ${own.note}` : ""),
        printed ? `${printed[1]} %` : null, others.map((g) => `${g.policy}: ${Format.percent(Summary.rate(g.episodes).value)} %`)));
      if (own.time !== null && own.time !== undefined) {
        cards.push(Summary.card(`${own.task}: seconds on the robot, median`, Format.number(own.time), "s", "simulated, from the start pose to the verdict", printed ? `${printed[2]} s` : null,
          others.map((g) => ({ g, t: Summary.time(g.episodes) })).filter((o) => o.t !== null).map((o) => `${o.g.policy}: ${Format.number(o.t)} s`)));
      }
    }
    return cards;
  },

  solverCards(data) {
    const cards = [];
    const table = Summary.find(data, "table1-plug") || Summary.find(data, "table4-pipe");
    if (table) {
      const row = table.rows.find((r) => String(r[0]).startsWith("e-rtdp-bel 2")), c = Summary.column(table, /^relative_speedup_cpu$/), p = Summary.column(table, /^printed_relative_speedup$/);
      const s = Summary.column(table, /^success_percent$/);
      const certified = table.rows.find((r) => String(r[0]).startsWith("certified"));
      if (certified && typeof certified[s] === "number") {
        cards.push(Summary.card("problems solved, certified policies", Format.number(certified[s]), "%", `${table.name}, time limit 30 s of CPU`, row && p >= 0 ? "100 % (E-RTDP-Bel), 78.9 to 86.5 % (RTDP-Bel)" : null,
          row && typeof row[s] === "number" ? [`E-RTDP-Bel, epsilon 2, here: ${Format.number(row[s])} %` + (typeof row[c] === "number" ? `, speedup ${Format.number(row[c])}` : "")] : []));
      }
    }
    return cards;
  },

  /** Relative cost of touch-based localization, from the widest belief of figure-tbl. */
  baselineCards(data) {
    const figure = Summary.find(data, "figure-tbl");
    if (!figure) return [];
    const policy = Summary.column(figure, /^policy$/), cost = Summary.column(figure, /relative_cost|cost_ratio|relative.*cost/), size = Summary.column(figure, /hypotheses/);
    if (policy < 0 || cost < 0 || size < 0) return [];
    const most = Math.max(...figure.rows.map((r) => r[size]).filter((v) => typeof v === "number"));
    const rows = figure.rows.filter((r) => r[size] === most && typeof r[cost] === "number");
    const tbl = rows.find((r) => r[policy] === "tbl") || rows.find((r) => String(r[policy]).startsWith("tbl"));
    if (!tbl) return [];
    return [Summary.card(`cost of touch-based localization at ${most} hypotheses`, Format.number(tbl[cost]), "× ours", "figure-tbl", "grows with the number of hypotheses; no values printed",
      rows.filter((r) => r !== tbl && String(r[policy]) !== "database").map((r) => `${r[policy]}: ${Format.number(r[cost])} ×`))];
  },

  build(section, data) {
    const groups = Summary.groups(data.records), episodes = data.records.reduce((n, r) => n + r.episodes.length, 0);
    const failed = data.records.reduce((n, r) => n + r.episodes.filter((e) => !e.inserted).length, 0);
    const cards = [...Summary.taskCards(data, groups), ...Summary.baselineCards(data), ...Summary.solverCards(data)];
    const parts = [];
    if (data.experiments.length) parts.push(`${data.experiments.length} experiment${data.experiments.length > 1 ? "s" : ""}`);
    if (episodes) parts.push(`${episodes.toLocaleString("en-US")} episodes${failed ? `, ${failed.toLocaleString("en-US")} of them failed` : ", none failed"}`);
    section.append(element("h1", {}, "Insertion by touch"), element("p", { class: "lead" }, `${parts.join(" and ")} in ${data.folder}. `,
      data.faults.length ? element("a", { href: "#faults" }, `${data.faults.length} fault${data.faults.length > 1 ? "s" : ""} in the folder.`) : null));
    if (cards.length) section.append(element("div", { class: "cards" }, cards));
    const policies = groups.filter((g) => g.episodes.length).map((g) => ({ label: `${g.task} · ${g.policy}${g.noise === "ideal" ? "" : " · " + g.noise}`, rate: Summary.rate(g.episodes) }));
    if (policies.length > 1) {
      section.append(element("div", { class: "figures" }, Plots.dots("Inserted", "with 95 % intervals", policies.map((p) => ({ label: p.label, marks: [{ value: 100 * p.rate.value, low: 100 * p.rate.low, high: 100 * p.rate.high, color: "var(--accent)" }] })), { label: "%", from: 90, to: 100 })));
    }
  },
};
