// Puts the page together.
"use strict";

const FeelerReport = { errors: [], ready: false, player: null };
window.addEventListener("error", (event) => FeelerReport.errors.push(String(event.message)));
window.addEventListener("unhandledrejection", (event) => FeelerReport.errors.push(String(event.reason)));

(function main() {
  const find = (id) => document.getElementById(id);
  const data = JSON.parse(find("feeler-data").textContent);
  for (const run of data.records) {
    run.label = run.file.replace(/\.jsonl$/, "").replace(/_/g, " ");
    run.episodes = run.episodes.map(([episode, inserted, localized, reason, time_s, error_mm, path_m, moves, contacts, force_n, plan_s, extents, rungs, replay]) =>
      ({ episode, inserted: inserted === 1, localized: localized === 1, reason, time_s, error_mm, path_m, moves, contacts, force_n, plan_s, extents, rungs, replay }));
  }

  const theme = (name) => { if (name) document.documentElement.dataset.theme = name; };
  try { theme(localStorage.getItem("feeler-theme")); } catch (error) { /* a page from a file may have no storage */ }
  find("theme").addEventListener("click", () => {
    const dark = document.documentElement.dataset.theme ? document.documentElement.dataset.theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
    theme(dark ? "light" : "dark");
    if (FeelerReport.player) FeelerReport.player.draw();
    try { localStorage.setItem("feeler-theme", dark ? "light" : "dark"); } catch (error) { /* as above */ }
  });

  Summary.build(find("summary"), data);
  for (const experiment of data.experiments) find("experiments").append(Sections.experiment(experiment, data.version));
  const go = (line) => {
    if (!FeelerReport.player || !FeelerReport.player.openLine(line)) return;
    find("replay").scrollIntoView();
    FeelerReport.player.canvas.focus({ preventScroll: true });
  };
  Sections.episodes(find("episodes"), data, go);
  Sections.faults(find("faults"), data);
  if (data.records.some((run) => run.episodes.some((e) => e.replay >= 0))) {
    FeelerReport.player = new Player(find("replay"), data.records, JSON.parse(find("feeler-scenes").textContent));
  }
  find("colophon").append(element("p", { class: "soft" }, `Made by feeler ${data.version} report ${data.folder}. Drawn with d3 and three.js, which are in the page; it loads nothing.`));

  const links = [["summary", "Summary"], ["replay", "Replays"], ...data.experiments.map((e) => [Sections.anchor(e), Sections.title(e).split(" · ")[0]]), ["episodes", "Episodes"], ["faults", "Faults"]];
  for (const [id, name] of links) if (find(id) && find(id).childNodes.length) find("contents").append(element("a", { href: "#" + id }, name));

  // #replay=3&time=4.2&view=arm&xray&play opens a replay at a moment.
  const openHash = () => {
    const wanted = new URLSearchParams(location.hash.slice(1)), player = FeelerReport.player;
    if (!wanted.has("replay") || !player || !player.openLine(+wanted.get("replay"))) return;
    find("replay").scrollIntoView({ behavior: "auto" });
    if (wanted.has("view")) player.setView(wanted.get("view"));
    if (wanted.has("xray")) player.toggleXray();
    if (wanted.has("time")) player.seek(player.replay.start + Number(wanted.get("time")));
    if (wanted.has("play")) player.play();
  };
  window.addEventListener("hashchange", openHash);
  openHash();
  const picture = (background) => {
    const stage = FeelerReport.player && FeelerReport.player.stage;
    if (!stage) return;
    stage.background = background;
    stage.render();
  };
  window.addEventListener("beforeprint", () => {
    document.querySelectorAll(".provenance, #episodes details").forEach((d) => { d.open = true; });
    picture("#eef0f1");  // paper is white whatever the screen is
  });
  window.addEventListener("afterprint", () => picture(null));
  FeelerReport.ready = true;
  FeelerReport.ready_ms = performance.now();
})();
