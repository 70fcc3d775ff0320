// The player: picks an episode, plays and steps through it; pointer, touch and keyboard.
"use strict";

const KIND_COLORS = { transfer: "#8fa3ad", probe: "#cf5214", confirm: "#c9982a", "fall-in": "#7a5ba6", retreat: "#b9c3c8", approach: "#5f9aa0", insert: "#2c7a4b" };
const kindColor = (kind) => KIND_COLORS[kind] || "#4a6fd0";

class Player {
  /** `runs`: the records with their replays; `scenes`: by task. */
  constructor(section, runs, scenes) {
    this.section = section;
    this.runs = runs.map((run) => ({ ...run, shown: run.episodes.filter((e) => e.replay >= 0) })).filter((run) => run.shown.length);
    this.scenes = scenes;
    this.time = 0;
    this.playing = false;
    this.speed = 1;
    this.frames = 0;
    this.build();
    new IntersectionObserver((entries) => { this.visible = entries.some((e) => e.isIntersecting); if (this.visible && !this.replay) this.openDefault(); }, { threshold: 0.05 }).observe(section);
    document.addEventListener("keydown", (event) => this.key(event));
    window.addEventListener("resize", () => this.draw());
  }

  build() {
    const button = (label, title, action, extra) => element("button", { type: "button", title, onclick: action, ...extra }, label);
    this.runSelect = element("select", { "aria-label": "Run", onchange: () => { this.fillEpisodes(); this.open(this.run(), this.run().shown[0]); } },
      this.runs.map((run, i) => element("option", { value: i }, run.label)));
    this.episodeSelect = element("select", { "aria-label": "Episode", onchange: () => this.open(this.run(), this.run().shown[this.episodeSelect.value]) });
    this.canvas = element("canvas", { tabindex: 0, "aria-label": "The episode in 3-D; drag to look around" });
    this.hud = element("div", { class: "hud", "aria-live": "off" });
    this.viewButtons = [["near", "Near", "1"], ["arm", "Arm", "2"], ["above", "Above", "3"]].map(([name, label, key]) =>
      button(label, `View: ${label} (${key})`, () => this.setView(name), { "data-view": name, "aria-pressed": name === "near" ? "true" : "false" }));
    this.xray = button("X-ray", "See through the target (X)", () => this.toggleXray(), { "aria-pressed": "false" });
    this.steps = element("ol", { "aria-label": "Moves" });
    this.playButton = button("▶ Play", "Play or pause (space)", () => this.toggle());
    this.clock = element("span", { class: "clock" });
    this.timeline = element("div", { class: "timeline", role: "slider", tabindex: 0, "aria-label": "Time", "aria-valuemin": 0 });
    const speed = element("select", { "aria-label": "Speed", onchange: (e) => { this.speed = +e.target.value; } }, [0.25, 0.5, 1, 2, 4].map((s) => element("option", { value: s, selected: s === 1 }, s + " ×")));
    this.section.append(
      element("h2", {}, "Replays"),
      element("p", { class: "soft" }, "What happened in physics, from the home pose to the verdict. Dots are hypotheses: where the mouth of the target may still be; they fade as touches rule them out. Orange marks are touches."),
      element("div", { class: "pick" }, this.runSelect, this.episodeSelect),
      element("div", { class: "player" },
        element("div", { class: "stage" }, this.canvas, this.hud, element("div", { class: "views" }, this.viewButtons, this.xray)),
        element("div", { class: "side" }, element("h3", {}, "Branch of the policy"), this.steps),
        element("div", { class: "controls" },
          element("div", { class: "buttons" }, button("◀◀", "Move before (←)", () => this.step(-1)), this.playButton, button("▶▶", "Next move (→)", () => this.step(1)), speed,
            button("‹ episode", "Episode before ([)", () => this.neighbour(-1)), button("episode ›", "Next episode (])", () => this.neighbour(1)), this.clock),
          this.timeline,
          element("div", { class: "keys" }, ...[["space", "play"], ["← →", "moves"], [", .", "frames"], ["[ ]", "episodes"], ["1 2 3", "views"], ["x", "x-ray"], ["home end", "ends"]].flatMap(([k, what]) => [element("kbd", {}, k), ` ${what}  `])))));
    const seek = (event) => {
      const box = this.timeline.getBoundingClientRect();
      this.seek(((event.clientX - box.left) / box.width) * this.replay.end);
    };
    this.timeline.addEventListener("pointerdown", (event) => { if (!this.replay) return; this.timeline.setPointerCapture(event.pointerId); this.dragging = true; this.pause(); seek(event); });
    this.timeline.addEventListener("pointermove", (event) => { if (this.dragging) seek(event); });
    this.timeline.addEventListener("pointerup", () => { this.dragging = false; });
    new ResizeObserver(() => requestAnimationFrame(() => this.drawTimeline())).observe(this.timeline);
    this.fillEpisodes();
  }

  run() { return this.runs[this.runSelect.value]; }

  fillEpisodes() {
    this.episodeSelect.textContent = "";
    this.run().shown.forEach((episode, i) => this.episodeSelect.append(
      element("option", { value: i }, `${episode.inserted ? "✓" : "✗"} episode ${episode.episode} · ${episode.extents} · ${episode.time_s.toFixed(1)} s${episode.rungs ? " · fallbacks" : ""}${episode.inserted ? "" : " · " + episode.reason}`)));
  }

  openDefault() { if (this.runs.length) this.open(this.run(), this.run().shown[0]); }

  /** Shows an episode by the number of its replay in the page. */
  openLine(line) {
    const index = this.runs.findIndex((run) => run.shown.some((e) => e.replay === line));
    if (index < 0) return false;
    this.runSelect.value = index;
    this.fillEpisodes();
    this.open(this.runs[index], this.runs[index].shown.find((e) => e.replay === line));
    return true;
  }

  open(run, episode) {
    this.pause();
    this.episodeSelect.value = run.shown.indexOf(episode);
    this.episode = episode;
    if (!this.stage && !this.failed) {
      try {
        this.stage = new Scene3D(this.canvas);
        this.stage.onChange = () => this.draw();
      } catch (error) {
        this.failed = true;
        this.canvas.replaceWith(element("p", { class: "note", style: "margin:5rem 1rem" }, "This browser gives no WebGL: the 3-D picture is left out."));
      }
    }
    this.replay = ReplayData.load(episode.replay);
    if (this.stage) {
      if (this.builtFor !== run.task) { this.stage.build(this.scenes[run.task] || null); this.builtFor = run.task; }
      this.stage.show(this.replay);
      this.stage.seeThrough(this.xray.getAttribute("aria-pressed") === "true");
      this.setView(this.stage.view);
    }
    this.listSteps();
    this.drawTimeline();
    this.seek(this.replay.start);
  }

  setView(name) {
    for (const b of this.viewButtons) b.setAttribute("aria-pressed", String(b.dataset.view === name));
    if (this.stage) this.stage.setView(name);
    this.draw();
  }

  toggleXray() {
    const on = this.xray.getAttribute("aria-pressed") !== "true";
    this.xray.setAttribute("aria-pressed", String(on));
    if (this.stage) this.stage.seeThrough(on);
    this.draw();
  }

  describe(motion) {
    const mm = (m) => (1e3 * m).toFixed(1) + " mm";
    const where = motion.direction ? motion.direction.replace("-", "−") + " " : "";
    return `${motion.kind} ${where}${mm(motion.travelled_m)}${motion.contact ? ", contact" : ""}`;
  }

  listSteps() {
    this.steps.textContent = "";
    let left = this.replay.hypotheses;
    this.rows = this.replay.motions.map((motion, i) => {
      const last = motion.decisions[motion.decisions.length - 1];
      const why = motion.decisions.filter((d) => d.outcomes > 1).map((d) => `${d.direction.replace("-", "−")} ${d.cells}: ${d.contact ? "contact at " + d.travelled : "free"}, one of ${d.outcomes} answers`).join("; ");
      const change = last && last.left !== left ? `${left} → ${last.left}` : "";
      if (last) left = last.left;
      const row = element("li", { onclick: () => { this.pause(); this.seek(motion.to); } },
        element("span", { class: "mark", style: `background:${kindColor(motion.kind)}`, title: motion.kind }), element("span", {}, this.describe(motion)), element("span", { class: "count" }, change),
        why ? element("span", { class: "why" }, why) : null);
      row.dataset.index = i;
      this.steps.append(row);
      return row;
    });
    for (const rung of this.replay.ladder) this.steps.append(element("li", {}, element("span", {}), element("span", { class: "why" }, `fallback ${rung.rung}: ${rung.reason}`)));
  }

  drawTimeline() {
    if (!this.replay) return;
    const width = Math.max(200, this.timeline.clientWidth), height = 64, replay = this.replay;
    this.timeline.textContent = "";
    const svg = d3.select(this.timeline).append("svg").attr("viewBox", `0 0 ${width} ${height}`);
    const x = d3.scaleLinear().domain([0, replay.end || 1]).range([0, width]);
    const most = d3.max(replay.contacts, (c) => c.force) || 1, y = d3.scaleLinear().domain([0, most]).range([36, 4]);
    svg.append("rect").attr("x", 0).attr("y", 39).attr("width", x(replay.start)).attr("height", 8).attr("rx", 2).attr("fill", "var(--line)").append("title").text("transfer to the start pose");
    for (const motion of replay.motions) {
      svg.append("rect").attr("x", x(motion.from)).attr("y", 39).attr("width", Math.max(0.8, x(motion.to) - x(motion.from) - 0.6)).attr("height", 8).attr("rx", 1.5).attr("fill", kindColor(motion.kind)).append("title").text(this.describe(motion));
    }
    svg.append("g").selectAll("line").data(replay.contacts).join("line").attr("x1", (c) => x(c.time)).attr("x2", (c) => x(c.time)).attr("y1", 37).attr("y2", (c) => y(c.force))
      .attr("stroke", "var(--contact)").attr("stroke-opacity", 0.75).attr("stroke-width", Math.max(1, 0.6 * x(replay.period)));
    svg.append("text").attr("class", "axis-label").attr("x", 2).attr("y", 11).style("font-size", "10px").style("fill", "var(--soft)").text(`contact force, up to ${most.toFixed(0)} N`);
    const kinds = [...new Set(replay.motions.map((m) => m.kind))];
    let at = 0;
    for (const kind of ["to start", ...kinds]) {
      svg.append("circle").attr("cx", at + 4).attr("cy", 57).attr("r", 3.6).attr("fill", kind === "to start" ? "var(--line)" : kindColor(kind));
      svg.append("text").attr("x", at + 11).attr("y", 60.5).style("font-size", "10px").style("fill", "var(--soft)").text(kind);
      at += 20 + kind.length * 5.6;
    }
    this.head = svg.append("line").attr("y1", 0).attr("y2", 49).attr("stroke", "var(--ink)").attr("stroke-width", 1.6);
    this.scale = x;
    this.timeline.setAttribute("aria-valuemax", replay.end.toFixed(2));
    this.moveHead();
  }

  moveHead() {
    if (!this.head) return;
    this.head.attr("x1", this.scale(this.time)).attr("x2", this.scale(this.time));
    this.timeline.setAttribute("aria-valuenow", this.time.toFixed(2));
    this.timeline.setAttribute("aria-valuetext", this.time.toFixed(2) + " seconds");
  }

  seek(time) {
    const replay = this.replay;
    if (!replay) return;
    this.time = Math.min(replay.end, Math.max(0, time));
    if (this.stage) this.stage.moveTo(replay, this.time);
    this.moveHead();
    const eps = 1e-6;
    const now = replay.motions.findIndex((m) => this.time < m.to - eps);
    const current = now < 0 ? replay.motions.length - 1 : this.time < replay.start - eps ? -1 : now;
    const made = replay.decisions.filter((d) => d.time <= this.time + eps);
    const left = made.length ? made[made.length - 1].left : replay.hypotheses;
    const motion = current >= 0 ? replay.motions[current] : null;
    const finished = this.time >= replay.end - 1e-3;
    this.hud.textContent = "";
    this.hud.append(
      replay.hypotheses ? element("div", { class: "left" }, left, element("small", {}, left === 1 ? " hypothesis left" : ` of ${replay.hypotheses} hypotheses`)) : "",
      element("div", { class: "now" }, finished ? element("span", { class: "badge " + (this.episode.inserted ? "yes" : "no") }, this.episode.inserted ? "inserted" : this.episode.reason) : motion ? this.describe(motion) : "transfer to the start pose"));
    this.clock.textContent = `${(this.time - replay.start).toFixed(2)} s of ${(replay.end - replay.start).toFixed(2)} s`;
    if (this.rows) {
      this.rows.forEach((row, i) => { row.className = i === current ? "now" : i < current ? "past" : "future"; });
      const row = this.rows[current];
      if (row && this.shownRow !== row) { this.steps.scrollTop = Math.max(0, row.offsetTop - this.steps.offsetTop - this.steps.clientHeight / 2); this.shownRow = row; }
    }
    this.draw();
  }

  draw() {
    if (!this.stage || this.pending) return;
    this.pending = true;
    requestAnimationFrame(() => { this.pending = false; this.stage.render(); this.frames += 1; });
  }

  toggle() { if (this.playing) this.pause(); else this.play(); }

  play() {
    if (!this.replay) this.openDefault();
    if (!this.replay || this.playing) return;
    if (this.time >= this.replay.end - 1e-3) this.seek(this.replay.start);
    this.playing = true;
    this.playButton.textContent = "❚❚ Pause";
    let before = performance.now();
    const tick = (now) => {
      if (!this.playing) return;
      const passed = Math.min(0.25, Math.max(0, (now - before) / 1e3));
      before = now;
      this.seek(this.time + passed * this.speed);
      if (this.time >= this.replay.end) this.pause(); else requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  pause() {
    this.playing = false;
    if (this.playButton) this.playButton.textContent = "▶ Play";
  }

  /** To the end of the next motion, or of the one before. */
  step(sign) {
    if (!this.replay) return;
    this.pause();
    const stops = [0, this.replay.start, ...this.replay.motions.map((m) => m.to)];
    const eps = 1e-4;
    const next = sign > 0 ? stops.find((t) => t > this.time + eps) : stops.filter((t) => t < this.time - eps).pop();
    this.seek(next === undefined ? (sign > 0 ? this.replay.end : 0) : next);
  }

  neighbour(sign) {
    if (!this.episode) return this.openDefault();
    const run = this.run(), at = run.shown.indexOf(this.episode) + sign;
    if (at >= 0 && at < run.shown.length) this.open(run, run.shown[at]);
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName)) return;
    const inside = this.section.contains(event.target);
    if (!inside && !this.visible) return;
    if (event.key === " " && event.target.tagName === "BUTTON" || event.key === " " && event.target.tagName === "SUMMARY") return;
    const actions = {
      " ": () => this.toggle(), ArrowLeft: () => this.step(-1), ArrowRight: () => this.step(1),
      ",": () => { this.pause(); this.seek(this.time - this.replay.period); }, ".": () => { this.pause(); this.seek(this.time + this.replay.period); },
      "[": () => this.neighbour(-1), "]": () => this.neighbour(1), 1: () => this.setView("near"), 2: () => this.setView("arm"), 3: () => this.setView("above"),
      x: () => this.toggleXray(), X: () => this.toggleXray(),
      Home: inside ? () => { this.pause(); this.seek(0); } : null, End: inside ? () => { this.pause(); this.seek(this.replay.end); } : null,
    };
    const action = actions[event.key];
    if (!action) return;
    if (!this.replay) this.openDefault();
    event.preventDefault();
    action();
  }
}
