#include "feeler/evaluation/cad_import/import_report.h"

#include <fmt/format.h>

#include <functional>
#include <vector>

#include "feeler/cad/folder/drawing.h"
#include "feeler/core/error.h"
#include "feeler/env/vision/renderer.h"
#include "feeler/env/vision/task_views.h"
#include "feeler/evaluation/records/replay_json.h"

namespace feeler::evaluation {
namespace {

const char* const kStyle =
    "body{font:15px/1.45 system-ui,sans-serif;max-width:1180px;margin:2em auto;padding:0 1em;color:#1b1f24}"
    "h1{font-size:1.5em}h2{font-size:1.15em;margin-top:1.8em;border-bottom:1px solid #d5d9de}"
    "table{border-collapse:collapse}td,th{border:1px solid #d5d9de;padding:3px 9px;text-align:left;vertical-align:top}"
    "th{background:#f2f4f6}.verdict{background:#eef4ff;border-left:4px solid #3b6fd4;padding:.7em 1em}"
    ".pictures{display:flex;flex-wrap:wrap;gap:14px;margin-top:14px}figure{margin:0;max-width:560px}img,svg{max-width:"
    "100%;height:auto;"
    "border:1px solid #d5d9de}"
    "figcaption{color:#555;font-size:.9em}code{background:#f2f4f6;padding:0 3px}"
    // On a phone the fields of the task file stand above what is said of them; wide tables scroll.
    ".wide{overflow-x:auto}table+.wide{margin-top:10px}@media(max-width:640px){body{margin:1em auto}"
    ".fields,.fields tbody,.fields tr,.fields td,.fields th{display:block}.fields td,.fields th{border-width:0 1px}"
    ".fields tr{border-bottom:1px solid #d5d9de}.fields .head{display:none}}";

std::string Html(const std::string& text) {
  std::string html;
  for (const char c : text) {
    switch (c) {
      case '&': html += "&amp;"; break;
      case '<': html += "&lt;"; break;
      case '>': html += "&gt;"; break;
      case '"': html += "&quot;"; break;
      default: html += c;
    }
  }
  return html;
}

std::string Row(const std::string& name, const std::string& value) {
  return fmt::format("<tr><th>{}</th><td>{}</td></tr>\n", Html(name), Html(value));
}

std::string Figure(const std::string& picture, const std::string& caption) {
  return fmt::format("<figure>{}<figcaption>{}</figcaption></figure>\n", picture, Html(caption));
}

std::string Millimetres(double m) { return fmt::format("{:.4f} mm", 1000 * m); }

std::string Drawings(const ImportedTask& task) {
  std::string html = "<div class=\"pictures\">\n";
  const auto add = [&](int axis, bool zoom, double depth, const std::string& caption) {
    cad::DrawingOptions options;
    options.axis = axis;
    options.zoom = zoom;
    options.tool_depth_m = depth;
    html += Figure(cad::SectionSvg(task.mating, task.tool.placed, task.target.placed, options), caption);
  };
  const double in = task.mating.depth_m;
  add(1, false, in, "Section across y, the tool in. Orange dashes: what the lid closes while the target is localized.");
  add(1, true, in, "The gap in x, enlarged.");
  add(0, false, in, "Section across x, the tool in.");
  add(0, true, in, "The gap in y, enlarged.");
  add(2, false, in, "Section across the way in, in the middle of the depth.");
  add(1, false, -0.2 * in, "About to enter.");
  return html + "</div>\n";
}

std::string Pictures(const ImportedTask& task) {
  std::string html = "<div class=\"pictures\">\n";
  const auto add = [&](const std::function<env::Image()>& render, const std::string& caption) {
    const std::string png = env::EncodePng(render());
    const std::vector<std::uint8_t> bytes(png.begin(), png.end());
    html += Figure("<img src=\"data:image/png;base64," + Base64(bytes) + "\">", caption);
  };
  try {
    const env::TaskModel model = env::LoadTask(task.task_file.string());
    env::TaskViewOptions view;
    view.width = 840;
    view.height = 630;
    add([&] { return env::RenderTaskMouth(model, view); }, "The mouth, with its lid (translucent).");
    view.depth_m = task.mating.depth_m;
    view.show_lids = false;
    add([&] { return env::RenderTaskSection(model, view); }, "The convex pieces cut open, the tool in.");
    const env::Scene scene = env::BuildScene(model);
    env::RendererOptions renderer;
    renderer.width = 840;
    renderer.height = 630;
    add([&] { return env::RenderSceneImage(scene, env::SceneView::kCloseUp, renderer); },
        "At the start, in the robot's gripper.");
    const Pose inserted = scene.task.world_T_target * Eigen::Translation3d(Eigen::Vector3d(0, 0, -task.mating.depth_m));
    add([&] { return env::RenderSceneImage(scene, inserted, env::SceneView::kCloseUp, renderer); }, "Inserted.");
  } catch (const Error& error) {
    html += fmt::format("<p>Pictures left out: {}</p>\n", Html(error.what()));
  }
  return html + "</div>\n";
}

std::string PartTable(const ImportedTask& task) {
  std::string html = "<div class=\"wide\"><table><tr><th></th><th>tool</th><th>target</th></tr>\n";
  const auto row = [&](const std::string& name, const std::function<std::string(const ImportedPart&)>& value) {
    html += fmt::format("<tr><th>{}</th><td>{}</td><td>{}</td></tr>\n", Html(name), Html(value(task.tool)),
                        Html(value(task.target)));
  };
  row("file", [](const ImportedPart& p) { return p.body.empty() ? p.file : p.file + "#" + p.body; });
  row("format", [](const ImportedPart& p) {
    return fmt::format("{}, {} triangles, {} solid{}", p.format, p.checked.mesh.size(), p.checked.solids.size(),
                       p.checked.solids.size() == 1 ? "" : "s");
  });
  row("unit", [](const ImportedPart& p) { return p.unit + ": " + p.unit_reason; });
  row("size", [](const ImportedPart& p) {
    const Eigen::Vector3d s = 1000 * cad::BoundsOf(p.checked.mesh).sizes();
    return fmt::format("{:.3f} x {:.3f} x {:.3f} mm, {:.4g} cm3", s.x(), s.y(), s.z(),
                       1e6 * cad::VolumeOf(p.checked.mesh));
  });
  const auto joined = [](const std::vector<std::string>& lines) {
    std::string text;
    for (const std::string& line : lines) text += (text.empty() ? "" : "; ") + line;
    return text.empty() ? std::string("nothing") : text;
  };
  row("mended", [&](const ImportedPart& p) { return joined(p.checked.mended); });
  row("convex pieces", [](const ImportedPart& p) { return fmt::format("{}", p.pieces.size()); });
  row("largest deviation where the parts mate", [](const ImportedPart& p) {
    return fmt::format("{} added, {} lost", Millimetres(p.mating.added_m), Millimetres(p.mating.lost_m));
  });
  row("largest deviation anywhere", [](const ImportedPart& p) {
    return fmt::format("{} added, {} lost", Millimetres(p.anywhere.added_m), Millimetres(p.anywhere.lost_m));
  });
  row("the same from 100,000 sampled points", [](const ImportedPart& p) {
    return fmt::format("{} added, {} lost", Millimetres(p.sampled.added_m), Millimetres(p.sampled.lost_m));
  });
  return html + "</table></div>\n";
}

std::string MatingTable(const ImportedTask& task) {
  const cad::Mating& m = task.mating;
  std::string html = "<table>\n";
  html += Row("opening", m.tool_has_opening ? "in the tool" : "in the target");
  html += Row("depth", Millimetres(m.depth_m) + (m.through ? ", the hole goes through" : ", then the tool stops"));
  html += Row("clearance a side, CAD",
              fmt::format("{:.4f} mm in x, {:.4f} mm in y", 1000 * m.clearance_m.x(), 1000 * m.clearance_m.y()));
  html += Row("clearance a side, convex pieces",
              fmt::format("{:.4f} mm in x, {:.4f} mm in y", 1000 * task.pieces_clearance_m.x(),
                          1000 * task.pieces_clearance_m.y()));
  html += Row("lead-in", fmt::format("{:.4f} mm in x, {:.4f} mm in y", 1000 * m.lead_in_m.x(), 1000 * m.lead_in_m.y()));
  html += Row("enters when displaced along both axes by",
              fmt::format("{:.4f} mm in x, {:.4f} mm in y", 1000 * m.mouth_play_m.x(), 1000 * m.mouth_play_m.y()));
  std::string turns = m.round ? "every turn fits: round" : m.turns_deg.empty() ? "one way only: keyed" : "turned by";
  if (!m.round) {
    for (const int degrees : m.turns_deg) turns += fmt::format(" {}", degrees);
    if (!m.turns_deg.empty()) turns += " degrees it fits as well";
  }
  html += Row("turns", turns);
  html += Row("lids", fmt::format("{}", task.content.lids.size()));
  return html + "</table>\n";
}

std::string NumbersTable(const ImportedTask& task) {
  std::string html = "<table class=\"fields\"><tr class=\"head\"><th>field</th><th>value</th><th>why</th></tr>\n";
  for (const cad::TaskNumber& n : task.content.numbers.fields) {
    html += fmt::format("<tr><th>{}</th><td>{}</td><td>{}</td></tr>\n", Html(n.field), Html(n.value), Html(n.reason));
  }
  return html + "</table>\n";
}

std::string TrialSection(const Trial& trial) {
  std::string html = "<h2>What touch can tell</h2>\n<ul>\n";
  for (const std::string& line : trial.felt) html += fmt::format("<li>{}</li>\n", Html(line));
  html += fmt::format("<li>walls stay at least {:.3f} cells from lattice planes</li>\n</ul>\n<h2>Trial</h2>\n<table>\n",
                      trial.margin_cells);
  html += Row("problem", trial.extents);
  html += Row("solved",
              trial.solved
                  ? fmt::format("yes: {:.1f} cells expected, certified within {:.3f} of the optimum, {:.1f} s of CPU",
                                trial.expected_cost_cells, trial.ratio, trial.solve_cpu_s)
                  : "no: " + trial.why_not);
  if (trial.solved)
    html += Row("verified", trial.verified ? "yes: replayed under every hypothesis" : "no: " + trial.why_not);
  html +=
      "</table>\n<div "
      "class=\"wide\"><table><tr><th>episodes</th><th>policy</th><th>inserted</th><th>localized</th><th>median "
      "s</th><th>peak N</th><th>with fallbacks</th><th>failures</th></tr>\n";
  for (const TrialRun& run : trial.runs) {
    std::string failures;
    for (const auto& [reason, count] : run.summary.failures)
      failures += fmt::format("{}{}: {}", failures.empty() ? "" : ", ", reason, count);
    html += fmt::format(
        "<tr><td>{} "
        "{}</td><td>{}</td><td>{}</td><td>{}</td><td>{:.2f}</td><td>{:.0f}</td><td>{}</td><td>{}</td></tr>\n",
        run.summary.episodes, Html(run.noise), Html(run.policy), run.summary.inserted.successes,
        run.summary.localized.successes, run.summary.sim_time_median_s, run.summary.peak_force_max_n,
        run.summary.ladder_used.successes, Html(failures));
  }
  return html + "</table></div>\n";
}

}  // namespace

std::string ImportReport(const ImportedTask& task, const std::optional<Trial>& trial) {
  std::string html = fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta "
      "charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width,initial-scale=1\"><title>{0}</title><style>{1}</style></head><body>\n<h1>{0}</"
      "h1>\n",
      Html(task.content.name), kStyle);
  html += fmt::format("<p class=\"verdict\">{}</p>\n", Html(Verdict(task, trial)));
  if (!task.notes.empty()) {
    html += "<h2>What to look at</h2>\n<ul>\n";
    for (const std::string& note : task.notes) html += fmt::format("<li>{}</li>\n", Html(note));
    html += "</ul>\n";
  }
  if (!task.findings.empty()) {
    html += "<h2>What may be wrong: <code>feeler task check</code></h2>\n<ul>\n";
    for (const env::TaskFinding& finding : task.findings) {
      html += fmt::format("<li>{} ({})</li>\n", Html(finding.what), Html(finding.mend));
    }
    html += "</ul>\n";
  }
  html += "<h2>How the parts mate</h2>\n" + MatingTable(task) + Drawings(task);
  html += "<h2>Parts, and their convex pieces</h2>\n" + PartTable(task);
  html += "<h2>As the simulator has them</h2>\n" + Pictures(task);
  if (trial) html += TrialSection(*trial);
  html += "<h2>Numbers of the task file</h2>\n" + NumbersTable(task);
  return html + "</body></html>\n";
}

}  // namespace feeler::evaluation
