// The first screen: what Feeler reaches, what the paper prints, what the baselines reach.
"use strict";

const Summary = {
  /** Episodes of the same task, policy and noise. Those of an experiment count there; here only if nothing else does. */
  groups(data) {
    const own = data.records.filter((run) => !data.experiments.some((e) => ("/" + run.file).includes("/" + e.name + "/")));
    const groups = new Map();
    for (const run of own.length ? own : data.records) {
      const key = [run.task, run.policy, run.noise].join("|");
      if (!groups.has(key)) groups.set(key, { task: run.task, policy: run.policy, noise: run.noise, episodes: [] });
      groups.get(key).episodes.push(...run.episodes);
    }
    return [...groups.values()];
  },

  rate(episodes) { return Statistics.wilson(episodes.filter((e) => e.inserted).length, episodes.length); },
  time(episodes) { return Statistics.quantile(episodes.filter((e) => e.inserted).map((e) => e.time_s), 0.5); },

  find(data, name) { return data.experiments.find((e) => e.name === name); },
  printedTask(data, task) { return data.paper.table2_framework.rows.find((r) => r[0].startsWith(task === "plug" ? "plug" : /^pipe/.test(task) ? "pipe" : "-")); },

  card(what, value, unit, interval, paper, baseline) {
    return element("div", { class: "card" }, element("div", { class: "what" }, what), element("div", { class: "value" }, value, unit ? element("small", {}, " " + unit) : null),
      element("div", { class: "interval" }, interval || "\u00a0"), paper ? element("div", { class: "paper" }, "the paper: ", element("b", {}, paper)) : null,
      baseline && baseline.length ? element("div", { class: "baseline" }, "others" + (baseline.note || ""), element("ul", {}, baseline.map((text) => element("li", {}, text)))) : null);
  },

  percentText(rate) { return `95 % interval ${Format.percent(rate.low)} to ${Format.percent(rate.high)}, ${rate.successes} of ${rate.trials}`; },

  /** [{policy, rate, time, note}] of the other policies on a task: from the baselines at their widest, else from records. */
  others(data, groups, task) {
    const table = Summary.find(data, "baselines");
    if (table) {
      const at = (name) => table.columns.indexOf(name), rows = table.rows.filter((r) => r[at("task")] === task);
      const widest = Math.max(...rows.map((r) => r[at("uncertainty_mm")]));
      return rows.filter((r) => r[at("uncertainty_mm")] === widest && !String(r[at("policy")]).startsWith("database"))
        .map((r) => ({ policy: r[at("policy")], rate: r[at("rate")], time: r[at("inserted")] > 0 ? r[at("time_median_s")] : null, note: `, baselines at ±${Format.number(widest / 2)} mm` }));
    }
    return groups.filter((g) => g.task === task && g.policy !== "database" && g.noise === "ideal").map((g) => ({ policy: g.policy, rate: Summary.rate(g.episodes).value, time: Summary.time(g.episodes), note: "" }));
  },

  /** Our success and time by task: from table2-framework, else from the records. */
  ours(data, groups) {
    const framework = Summary.find(data, "table2-framework");
    if (framework) {
      const at = (name) => framework.columns.indexOf(name);
      return ["plug", "pipe"].map((task) => ({ task, row: framework.rows.find((r) => String(r[at("row")]).startsWith(task)) })).filter((o) => o.row)
        .map(({ task, row }) => ({ task, value: row[at("rate")], low: row[at("rate_low")], high: row[at("rate_high")], time: row[at("inserted")] > 0 ? row[at("time_median_s")] : null, note: `${row[at("inserted")]} of ${row[at("episodes")]} episodes, table2-framework` }));
    }
    const rest = groups.filter((g) => g.policy === "database" && g.noise === "ideal").map((g) => {
      const rate = Summary.rate(g.episodes);
      return { task: g.task, value: rate.value, low: rate.low, high: rate.high, time: Summary.time(g.episodes), note: `${rate.successes} of ${rate.trials} episodes` };
    });
    return rest.sort((a, b) => (b.task === "plug") - (a.task === "plug")).slice(0, 2);
  },

  taskCards(data, groups) {
    return Summary.ours(data, groups).flatMap((own) => {
      const printed = Summary.printedTask(data, own.task), others = Summary.others(data, groups, own.task).slice(0, 8), sort = (values, by) => [...values].sort(by);
      const list = (values, text) => Object.assign(values.map(text), { note: values.length ? values[0].note : "" });
      const cards = [Summary.card(`${own.task}: inserted`, Format.percent(own.value), "%", `95 % interval ${Format.percent(own.low)} to ${Format.percent(own.high)} · ${own.note}`,
        printed ? `${printed[1]} %` : null, list(sort(others, (a, b) => b.rate - a.rate), (o) => `${o.policy}: ${Format.percent(o.rate)} %`))];
      if (own.time !== null) {
        cards.push(Summary.card(`${own.task}: time on the robot`, Format.number(own.time), "s", "median of inserted, start pose to verdict, simulated", printed ? `${printed[2]} s` : null,
          list(sort(others.filter((o) => o.time !== null), (a, b) => a.time - b.time), (o) => `${o.policy}: ${Format.number(o.time)} s`)));
      }
      return cards;
    });
  },

  solverCards(data) {
    const cards = [];
    const table = Summary.find(data, "table1-plug") || Summary.find(data, "table4-pipe");
    if (table) {
      const at = (name) => table.columns.indexOf(name), c = at("relative_speedup_cpu"), p = at("printed_relative_speedup"), s = at("success_percent");
      const row = table.rows.find((r) => String(r[0]).startsWith("e-rtdp-bel 2"));
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
    const at = (name) => figure.columns.indexOf(name), policy = at("policy"), cost = at("relative_cost"), size = at("hypotheses");
    if (policy < 0 || cost < 0 || size < 0) return [];
    const kinds = figure.rows.filter((r) => typeof r[cost] === "number" && (at("cost") < 0 || r[at("cost")] === figure.rows[0][at("cost")]));
    const most = Math.max(...kinds.filter((r) => String(r[policy]).startsWith("tbl")).map((r) => r[size]));
    const rows = kinds.filter((r) => r[size] === most);
    const tbl = rows.find((r) => r[policy] === "tbl") || rows.find((r) => String(r[policy]).startsWith("tbl"));
    if (!tbl) return [];
    return [Summary.card(`cost of touch-based localization at ${most} hypotheses`, Format.number(tbl[cost]), "× ours", "figure-tbl", "grows with the number of hypotheses; no values printed",
      rows.filter((r) => r !== tbl && String(r[policy]) !== "database").map((r) => `${r[policy]}: ${Format.number(r[cost])} ×`))];
  },

  build(section, data) {
    const groups = Summary.groups(data), episodes = data.records.reduce((n, r) => n + r.episodes.length, 0);
    const failed = data.records.reduce((n, r) => n + r.episodes.filter((e) => !e.inserted).length, 0);
    const cards = [...Summary.taskCards(data, groups), ...Summary.baselineCards(data), ...Summary.solverCards(data)];
    const parts = [];
    if (data.experiments.length) parts.push(`${data.experiments.length} experiment${data.experiments.length > 1 ? "s" : ""}`);
    if (episodes) parts.push(`${episodes.toLocaleString("en-US")} episodes${failed ? `, ${failed.toLocaleString("en-US")} of them failed` : ", none failed"}`);
    section.append(element("h1", {}, "Insertion by touch"), element("p", { class: "lead" }, `${parts.join(" and ")}. Folder: ${data.folder}. `,
      data.faults.length ? element("a", { href: "#faults" }, `${data.faults.length} fault${data.faults.length > 1 ? "s" : ""} in the folder.`) : null));
    if (cards.length) section.append(element("div", { class: "cards" }, cards));
    const policies = groups.filter((g) => g.episodes.length).map((g) => ({ label: `${g.task} · ${g.policy}${g.noise === "ideal" ? "" : " · " + g.noise}`, rate: Summary.rate(g.episodes) }));
    if (policies.length > 1) {
      section.append(element("div", { class: "figures" }, Plots.dots("Inserted", "by task, policy and noise over the runs of the folder; 95 % intervals", policies.map((p) => ({ label: p.label, marks: [{ value: 100 * p.rate.value, low: 100 * p.rate.low, high: 100 * p.rate.high, color: "var(--accent)" }] })), { label: "%", from: 90, to: 100 })));
    }
  },
};
