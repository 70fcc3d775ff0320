// Numbers and names as people read them, and small helpers for elements.
"use strict";

const Format = {
  /** Three significant digits, more where they are whole. */
  number(value) {
    if (value === null || value === undefined) return "–";
    if (typeof value !== "number") return String(value);
    if (!isFinite(value)) return String(value);
    if (Number.isInteger(value)) return Math.abs(value) >= 10000 ? value.toLocaleString("en-US") : String(value);
    const size = Math.abs(value);
    if (size >= 1e6) return Math.round(value).toLocaleString("en-US");
    if (size >= 100) return value.toFixed(0);
    if (size >= 10) return value.toFixed(1);
    if (size >= 1) return value.toFixed(2);
    if (size >= 0.01) return value.toFixed(3);
    if (size === 0) return "0";
    return value.toPrecision(2);
  },
  /** For axes: no zeros at the end. */
  tick(value) { return value === 0 ? "0" : Math.abs(value) >= 10000 ? value.toLocaleString("en-US") : String(+value.toPrecision(4)); },
  percent(value) {
    if (value === null || value === undefined) return "–";
    return String(+(100 * value).toFixed(1));
  },
  /** "sim_time_median_s" -> "sim time median, s"; what is read often has a better name. */
  column(name) {
    const better = { rate: "inserted", success_percent: "success, %", relative_speedup_cpu: "speedup, CPU time", relative_speedup_expansions: "speedup, expansions", relative_cost_to_base: "cost to base", cost_to_certified: "cost to certified", ladder_use: "fallbacks used", error_p50_mm: "error median, mm", error_p95_mm: "error 95 %, mm" };
    if (better[name]) return better[name];
    const units = { s: "s", mm: "mm", m: "m", n: "N", percent: "%", rad: "rad", deg: "°", bytes: "bytes", ms: "ms" };
    const words = String(name).split("_");
    const unit = words.length > 1 ? units[words[words.length - 1]] : undefined;
    if (unit) words.pop();
    return words.join(" ") + (unit ? ", " + unit : "");
  },
  /** Is a column a share between 0 and 1? */
  isShare(name) { return /(^|_)(rate|use|share|value)$/.test(name); },
  seconds(value) { return value.toFixed(value < 100 ? 2 : 0) + " s"; },
};

const Statistics = {
  /** Wilson's interval at 95 %. */
  wilson(successes, trials) {
    if (trials === 0) return { value: 0, low: 0, high: 1, successes, trials };
    const z = 1.959963984540054, p = successes / trials, n = trials;
    const centre = (p + z * z / (2 * n)) / (1 + z * z / n);
    const half = z * Math.sqrt(p * (1 - p) / n + z * z / (4 * n * n)) / (1 + z * z / n);
    return { value: p, low: Math.max(0, centre - half), high: Math.min(1, centre + half), successes, trials };
  },
  quantile(values, q) {
    const sorted = values.filter((v) => v !== null).sort((a, b) => a - b);
    if (!sorted.length) return null;
    const at = q * (sorted.length - 1), below = Math.floor(at);
    return sorted[below] + (at - below) * (sorted[Math.min(below + 1, sorted.length - 1)] - sorted[below]);
  },
  mean(values) {
    const known = values.filter((v) => v !== null);
    return known.length ? known.reduce((a, b) => a + b, 0) / known.length : null;
  },
};

/** element("p", {class: "lead", onclick: f}, child, ...); text is text, never markup. */
function element(name, attributes, ...children) {
  const node = document.createElement(name);
  for (const [key, value] of Object.entries(attributes || {})) {
    if (value === null || value === undefined || value === false) continue;
    if (key.startsWith("on")) node.addEventListener(key.slice(2), value);
    else node.setAttribute(key, value === true ? "" : value);
  }
  for (const child of children.flat()) {
    if (child === null || child === undefined || child === false) continue;
    node.append(child instanceof Node ? child : document.createTextNode(String(child)));
  }
  return node;
}
