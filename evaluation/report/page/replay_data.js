// Replays as they stand in the page, unpacked (docs/file-formats.md, "Replays").
"use strict";

const ReplayData = {
  lines: null,

  bytes(base64) {
    const text = atob(base64), bytes = new Uint8Array(text.length);
    for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
    return bytes;
  },

  /** All varints of some bytes. */
  varints(bytes) {
    const values = [];
    let value = 0, factor = 1;
    for (const byte of bytes) {
      value += (byte & 127) * factor;
      factor *= 128;
      if (byte < 128) { values.push(value); value = 0; factor = 1; }
    }
    return values;
  },

  /** Joint positions, six a sample, rad. */
  joints(base64) {
    const q = new Float64Array(ReplayData.varints(ReplayData.bytes(base64)).map((v) => (v % 2 ? -(v + 1) / 2 : v / 2)));
    for (let i = 6; i < q.length; ++i) q[i] += q[i - 6];
    return q.map((steps) => steps * 2e-5);
  },

  runs(base64, count) {
    const values = new Int32Array(count), packed = ReplayData.varints(ReplayData.bytes(base64));
    let at = 0;
    for (let i = 0; i + 1 < packed.length; i += 2) { values.fill(packed[i], at, at + packed[i + 1]); at += packed[i + 1]; }
    return values;
  },

  pose(packed) { return packed && { position: packed.slice(0, 3), quaternion: packed.slice(3) }; },

  /** Replay number `line` of the page. */
  load(line) {
    if (!ReplayData.lines) ReplayData.lines = document.getElementById("feeler-replays").textContent.split("\n");
    const raw = JSON.parse(ReplayData.lines[line]), replay = raw.replay;
    const q = ReplayData.joints(replay.joints), samples = q.length / 6;
    const times = Array.from({ length: samples }, (_, i) => i * replay.period_s);
    let clock = replay.start_s;
    const motions = raw.moves.map(([kind, direction, commanded, predicted, travelled, contact, force, duration]) => {
      const from = clock;
      clock += duration / 1e3;
      return { kind, direction, commanded_m: commanded / 1e5, predicted_m: predicted && predicted.map((v) => v / 1e5), travelled_m: travelled / 1e5,
        contact: contact === 1, force_n: force / 10, from, to: clock, decisions: [] };
    });
    // The last sample stands where the episode ended, which is less than a period after the one before.
    if (samples > 1) times[samples - 1] = Math.max(times[samples - 2], Math.min(times[samples - 1], Math.max(clock, times[samples - 2])));
    const decisions = replay.decisions.map(([attempt, made, direction, cells, travelled, contact, outcomes, left]) => {
      const index = Math.max(0, Math.min(made - 1, motions.length - 1));
      const decision = { attempt, direction, cells, travelled, contact, outcomes, left, time: made > 0 && motions.length ? motions[index].to : replay.start_s };
      if (motions.length) motions[index].decisions.push(decision);
      return decision;
    });
    return {
      truth: ReplayData.pose(raw.truth), told: ReplayData.pose(raw.told), estimate: ReplayData.pose(raw.estimate), extents: raw.extents, ladder: raw.ladder,
      q, times, end: times[samples - 1] || 0, start: replay.start_s, period: replay.period_s, motions, decisions, hypotheses: replay.hypotheses,
      ruledOut: ReplayData.runs(replay.ruled_out, replay.hypotheses),
      contacts: replay.contacts.map(([sample, x, y, z, force]) => ({ time: Math.min(times[samples - 1] || 0, sample * replay.period_s), point: [x / 1e5, y / 1e5, z / 1e5], force: force / 10 })),
    };
  },
};
