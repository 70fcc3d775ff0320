// What the tests ask of a page in a browser. The answer goes to the console as one line of JSON.
"use strict";
(async () => {
  const out = { ready: FeelerReport.ready, ready_ms: Math.round(FeelerReport.ready_ms || 0) };
  const wait = (ms) => new Promise((done) => setTimeout(done, ms));
  const until = async (what) => { for (let i = 0; i < 400 && !what(); ++i) await wait(25); return Boolean(what()); };
  const press = (key, target) => (target || document.body).dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true, cancelable: true }));
  // Colours that a canvas shows: an empty one shows one.
  const colors = (canvas) => {
    const small = document.createElement("canvas");
    small.width = small.height = 48;
    const context = small.getContext("2d");
    context.drawImage(canvas, 0, 0, 48, 48);
    const pixels = context.getImageData(0, 0, 48, 48).data, seen = new Set();
    for (let i = 0; i < pixels.length; i += 4) seen.add(pixels.slice(i, i + 4).join());
    return seen.size;
  };
  try {
    await until(() => Plots.drawn > 0 || !document.querySelector(".plot"));
    await wait(50);
    out.plots = document.querySelectorAll("figure svg").length;
    out.marks = document.querySelectorAll("figure svg .dot").length;
    out.intervals = document.querySelectorAll("figure svg .interval").length;
    out.tables = document.querySelectorAll("table").length;
    out.cells = document.querySelectorAll("td").length;
    out.cards = document.querySelectorAll(".card").length;
    out.faults = document.querySelectorAll("#faults tbody tr").length;
    out.wider_than_window = document.documentElement.scrollWidth > document.documentElement.clientWidth;
    out.requests = performance.getEntriesByType("resource").filter((r) => !r.name.startsWith("data:")).map((r) => r.name);
    const player = FeelerReport.player;
    out.has_player = Boolean(player);
    if (player) {
      const section = document.getElementById("replay");
      section.scrollIntoView({ behavior: "auto" });
      out.opened = await until(() => player.replay);
      out.webgl = Boolean(player.stage);
      await until(() => player.frames > 0 || !player.stage);
      out.colors = player.stage ? colors(player.canvas) : 0;
      out.motions = player.replay.motions.length;
      out.end_s = player.replay.end;
      out.clock_end_s = player.replay.motions.length ? player.replay.motions[player.replay.motions.length - 1].to : 0;
      out.hypotheses = player.replay.hypotheses;
      out.left = player.replay.hypotheses - Array.from(player.replay.ruledOut).filter((by) => by > 0).length;
      out.last_left = player.replay.decisions.length ? player.replay.decisions[player.replay.decisions.length - 1].left : -1;
      // The tool, by the joints of the last sample, against the target: inserted means at depth.
      if (player.stage && player.stage.tool) {
        player.seek(player.replay.end);
        player.stage.world.updateMatrixWorld(true);
        const tip = new THREE.Vector3().setFromMatrixPosition(player.stage.tool.matrixWorld), mouth = new THREE.Vector3().fromArray(player.replay.truth.position);
        out.depth_m = mouth.z - tip.z;
        out.aside_m = Math.hypot(tip.x - mouth.x, tip.y - mouth.y);
        out.path_vertices = player.stage.path.geometry.attributes.position.count;
      }
      out.badge = section.querySelector(".hud .badge") ? section.querySelector(".hud .badge").textContent : "";
      press("Home", player.canvas);
      out.home_s = player.time;
      press("ArrowRight");
      out.after_right_s = player.time;
      out.start_s = player.replay.start;
      press("ArrowRight");
      out.after_second_right_s = player.time;
      out.first_motion_end_s = player.replay.motions.length ? player.replay.motions[0].to : 0;
      press("ArrowLeft");
      out.after_left_s = player.time;
      press(".");
      out.after_dot_s = player.time;
      press("2");
      out.view = player.stage ? player.stage.view : "arm";
      press("x");
      out.xray = player.xray.getAttribute("aria-pressed");
      const episode = player.episode;
      press("]");
      out.next_episode = player.episode !== episode;
      press("[");
      out.same_episode = player.episode === episode;
      const before = player.time, frames = player.frames;
      press(" ");
      out.playing = player.playing;
      await until(() => player.time > before + 0.3);
      out.played_s = player.time - before;
      out.frames = player.frames - frames;
      press(" ");
      out.paused = !player.playing;
      out.marked_rows = section.querySelectorAll(".side li.now").length;
    }
    document.getElementById("theme").click();
    out.theme = document.documentElement.dataset.theme;
  } catch (error) {
    out.exception = String(error && error.stack || error);
  }
  out.errors = FeelerReport.errors;
  console.log("CHECK:" + JSON.stringify(out) + ":END");
})();
