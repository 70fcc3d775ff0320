#include "feeler/policies/io/policy_drawing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <vector>

#include "feeler/core/error.h"

namespace feeler::policies {
namespace {

using fmt::format_to;
using planner::ExpandedBranch;
using planner::ExpandedNode;
using planner::ExpandedPolicy;

/// A node that is drawn, and where.
struct Drawn {
  int node = 0;
  int parent = -1;                         ///< index into the list; -1: the root
  const ExpandedBranch* branch = nullptr;  ///< from the parent
  int depth = 0;
  bool cut = false;  ///< what follows is not drawn
  double row = 0.0;  ///< leaves take rows of their own, a parent stands amid its children
};

/// Parents before children, children in order of probability, as far as the options let.
std::vector<Drawn> ListDrawn(const ExpandedPolicy& policy, const PolicyDrawingOptions& options) {
  if (options.max_depth < 0) throw InputError("depth", "is negative", "give 0 or more");
  if (!(options.min_probability >= 0.0 && options.min_probability <= 1.0)) {
    throw InputError("probability", "is not in 0..1", "give 0 to draw everything");
  }
  const auto at = [&](int node) -> const ExpandedNode& { return policy.nodes[static_cast<std::size_t>(node)]; };
  std::vector<Drawn> list;
  std::vector<Drawn> open = {{}};
  double rows = 0.0;
  while (!open.empty()) {  // depth first, so that rows follow the drawing order
    Drawn drawn = open.back();
    open.pop_back();
    const ExpandedNode& node = at(drawn.node);
    drawn.cut = !node.is_leaf() && (drawn.depth >= options.max_depth || node.probability < options.min_probability);
    if (node.is_leaf() || drawn.cut) drawn.row = rows++;
    const auto index = static_cast<int>(list.size());
    list.push_back(drawn);
    if (drawn.cut) continue;
    std::vector<const ExpandedBranch*> branches;
    for (const ExpandedBranch& branch : node.outcomes) branches.push_back(&branch);
    std::stable_sort(branches.begin(), branches.end(), [](const ExpandedBranch* a, const ExpandedBranch* b) {
      return a->probability < b->probability;  // the last one is taken first
    });
    for (const ExpandedBranch* branch : branches) {
      open.push_back({branch->next, index, branch, drawn.depth + 1, false, 0.0});
    }
  }
  std::vector<int> children(list.size(), 0);
  for (std::size_t i = list.size(); i-- > 0;) {
    if (children[i] > 0) list[i].row /= children[i];
    if (list[i].parent < 0) continue;
    list[static_cast<std::size_t>(list[i].parent)].row += list[i].row;
    ++children[static_cast<std::size_t>(list[i].parent)];
  }
  return list;
}

std::string Hypotheses(const ExpandedNode& node) {
  if (node.hypotheses.size() > 3) return fmt::format("{} hypotheses", node.hypotheses.size());
  std::string text = "h";
  for (std::size_t i = 0; i < node.hypotheses.size(); ++i)
    text += fmt::format("{}{}", i ? ", " : "", node.hypotheses[i]);
  return text;
}

std::string MoveText(const GuardedMove& move) { return fmt::format("{} {}", ToString(move.direction), move.cells); }

std::string OutcomeText(const Outcome& outcome) {
  return fmt::format("{}{}", outcome.cells, outcome.contact ? " contact" : "");
}

std::string Details(const ExpandedNode& node) {
  return fmt::format(
      "robot at ({}, {}, {}); {} hypotheses left; reached with probability {:.4g}; expected cost to go {:.4g}",
      node.robot.x(), node.robot.y(), node.robot.z(), node.hypotheses.size(), node.probability, node.expected_cost);
}

std::string EscapeDot(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '"' || c == '\\') escaped += '\\';
    escaped += c == '\n' || c == '\r' ? ' ' : c;
  }
  return escaped;
}

std::string EscapeHtml(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '&': escaped += "&amp;"; break;
      case '<': escaped += "&lt;"; break;
      case '>': escaped += "&gt;"; break;
      case '"': escaped += "&quot;"; break;
      default: escaped += c;
    }
  }
  return escaped;
}

std::string Summary(const ExpandedPolicy& policy, const std::vector<Drawn>& drawn) {
  std::size_t moves = 0, leaves = 0, deepest = 0, cut = 0;
  std::vector<std::size_t> depth(policy.nodes.size(), 0);
  for (std::size_t i = 0; i < policy.nodes.size(); ++i) {
    (policy.nodes[i].is_leaf() ? leaves : moves) += 1;
    deepest = std::max(deepest, depth[i]);
    for (const ExpandedBranch& branch : policy.nodes[i].outcomes) {
      depth[static_cast<std::size_t>(branch.next)] = depth[i] + 1;
    }
  }
  for (const Drawn& d : drawn) cut += d.cut ? 1 : 0;
  std::string text =
      fmt::format("{} hypotheses, expected cost {:.6g}, proven lower bound {:.6g}; {} moves, {} leaves, depth {}",
                  policy.nodes.empty() ? 0 : policy.nodes[0].hypotheses.size(), policy.expected_cost,
                  policy.lower_bound, moves, leaves, deepest);
  if (cut > 0) text += fmt::format("; {} branches cut", cut);
  return text;
}

// Drawing, in pixels.
constexpr double kColumn = 230.0;
constexpr double kRow = 40.0;
constexpr double kBoxWidth = 84.0;
constexpr double kBoxHeight = 28.0;
constexpr double kMargin = 16.0;
constexpr double kBend = 36.0;  // an edge bends within this, then runs level under its label

constexpr const char* kStyle = R"(
 body{font:14px/1.4 system-ui,sans-serif;margin:24px;color:#1c2330;background:#fff}
 h1{font-size:20px;margin:0 0 4px} p{margin:0 0 12px;color:#4a5568} .scroll{overflow:auto;border:1px solid #d8dee8}
 svg{display:block} text{font:12px system-ui,sans-serif;fill:#1c2330;text-anchor:middle;dominant-baseline:central}
 .edge{fill:none;stroke:#9aa7bb} .contact{stroke:#d1603d} .label{font-size:11px;fill:#4a5568;text-anchor:end;
 paint-order:stroke;stroke:#fff;stroke-width:3px}
 .move rect{fill:#e8eef9;stroke:#4a6fb5} .leaf rect{fill:#e4f4e8;stroke:#3c8d55} .cut rect{fill:#f3f3f3;stroke:#9a9a9a;
 stroke-dasharray:4 3} g:hover rect{stroke-width:2.5}
 .key{display:inline-block;width:12px;height:12px;margin:0 4px 0 14px;border:1px solid;vertical-align:-1px}
)";

}  // namespace

std::string FormatPolicyDot(const ExpandedPolicy& policy, const std::string& title,
                            const PolicyDrawingOptions& options) {
  const std::vector<Drawn> list = ListDrawn(policy, options);
  std::string text;
  const auto out = std::back_inserter(text);
  format_to(out, "digraph policy {{\n  label=\"{}\\n{}\";\n  labelloc=t;\n  rankdir=LR;\n", EscapeDot(title),
            EscapeDot(Summary(policy, list)));
  text += "  node [shape=box, style=\"rounded,filled\", fontname=\"sans-serif\", fontsize=11];\n";
  text += "  edge [fontname=\"sans-serif\", fontsize=10];\n";
  for (std::size_t i = 0; i < list.size(); ++i) {
    const ExpandedNode& node = policy.nodes[static_cast<std::size_t>(list[i].node)];
    const std::string label = list[i].cut
                                  ? fmt::format("... {}\\ncost to go {:.3g}", Hypotheses(node), node.expected_cost)
                              : node.is_leaf() ? Hypotheses(node)
                                               : MoveText(node.move);
    const char* colour = list[i].cut ? "#f3f3f3" : node.is_leaf() ? "#e4f4e8" : "#e8eef9";
    format_to(out, "  n{} [label=\"{}\", fillcolor=\"{}\", tooltip=\"{}\"];\n", i, label, colour, Details(node));
    if (list[i].branch == nullptr) continue;
    format_to(out, "  n{} -> n{} [label=\"{} ({:.3g})\", color=\"{}\", penwidth={:.2f}];\n", list[i].parent, i,
              OutcomeText(list[i].branch->outcome), list[i].branch->probability,
              list[i].branch->outcome.contact ? "#d1603d" : "#9aa7bb", 1.0 + 4.0 * std::sqrt(node.probability));
  }
  return text + "}\n";
}

std::string FormatPolicyHtml(const ExpandedPolicy& policy, const std::string& title,
                             const PolicyDrawingOptions& options) {
  const std::vector<Drawn> list = ListDrawn(policy, options);
  double rows = 0.0;
  int columns = 0;
  for (const Drawn& drawn : list) {
    rows = std::max(rows, drawn.row + 1.0);
    columns = std::max(columns, drawn.depth + 1);
  }
  const auto left = [](const Drawn& drawn) { return kMargin + drawn.depth * kColumn; };
  const auto middle = [](const Drawn& drawn) { return kMargin + kBoxHeight / 2.0 + drawn.row * kRow; };
  const double width = 2.0 * kMargin + (columns - 1) * kColumn + kBoxWidth;
  const double height = 2.0 * kMargin + (rows - 1.0) * kRow + kBoxHeight;
  std::string text;
  const auto out = std::back_inserter(text);
  format_to(
      out,
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>{}</title>\n<style>{}</style>\n",
      EscapeHtml(title), kStyle);
  format_to(out, "</head>\n<body>\n<h1>{}</h1>\n<p>{}</p>\n", EscapeHtml(title), EscapeHtml(Summary(policy, list)));
  text +=
      "<p>Each box is a guarded move: direction and cells at most. Each edge is an outcome: cells travelled, and its "
      "probability; its width shows how often it is taken.";
  text +=
      "<span class=\"key\" style=\"background:#e8eef9;border-color:#4a6fb5\"></span>move"
      "<span class=\"key\" style=\"background:#e4f4e8;border-color:#3c8d55\"></span>localized"
      "<span class=\"key\" style=\"background:#f3f3f3;border-color:#9a9a9a\"></span>cut off"
      "<span class=\"key\" style=\"background:#d1603d;border-color:#d1603d;height:4px;vertical-align:4px\"></span>"
      "contact</p>\n";
  format_to(
      out,
      "<div class=\"scroll\"><svg width=\"{:.0f}\" height=\"{:.0f}\" viewBox=\"0 0 {:.0f} {:.0f}\" role=\"img\">\n",
      width, height, width, height);
  for (const Drawn& drawn : list) {
    if (drawn.branch == nullptr) continue;
    const Drawn& parent = list[static_cast<std::size_t>(drawn.parent)];
    const double probability = policy.nodes[static_cast<std::size_t>(drawn.node)].probability;
    const double x0 = left(parent) + kBoxWidth, x1 = left(drawn), y0 = middle(parent), y1 = middle(drawn);
    format_to(out,
              "<path class=\"edge{}\" stroke-width=\"{:.2f}\" d=\"M{:.1f} {:.1f}C{:.1f} {:.1f} {:.1f} {:.1f} {:.1f} "
              "{:.1f}L{:.1f} {:.1f}\"/>\n",
              drawn.branch->outcome.contact ? " contact" : "", 1.0 + 5.0 * std::sqrt(probability), x0, y0,
              x0 + kBend / 2.0, y0, x0 + kBend / 2.0, y1, x0 + kBend, y1, x1, y1);
  }
  for (const Drawn& drawn : list) {
    const ExpandedNode& node = policy.nodes[static_cast<std::size_t>(drawn.node)];
    const char* kind = drawn.cut ? "cut" : node.is_leaf() ? "leaf" : "move";
    const std::string label = drawn.cut        ? fmt::format("\xE2\x80\xA6 {} left", node.hypotheses.size())
                              : node.is_leaf() ? Hypotheses(node)
                                               : MoveText(node.move);
    format_to(out, "<g class=\"{}\"><title>{}</title>", kind, Details(node));
    format_to(out, "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{}\" height=\"{}\" rx=\"5\"/>", left(drawn),
              middle(drawn) - kBoxHeight / 2.0, kBoxWidth, kBoxHeight);
    format_to(out, "<text x=\"{:.1f}\" y=\"{:.1f}\">{}</text></g>\n", left(drawn) + kBoxWidth / 2.0, middle(drawn),
              label);
    if (drawn.branch == nullptr) continue;
    format_to(out, "<text class=\"label\" x=\"{:.1f}\" y=\"{:.1f}\">{} \xC2\xB7 {:.0f}%</text>\n", left(drawn) - 6.0,
              middle(drawn) - 9.0, OutcomeText(drawn.branch->outcome), 100.0 * drawn.branch->probability);
  }
  return text + "</svg></div>\n</body>\n</html>\n";
}

}  // namespace feeler::policies
