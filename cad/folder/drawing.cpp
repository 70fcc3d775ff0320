#include "feeler/cad/folder/drawing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "feeler/cad/section/section.h"

namespace feeler::cad {
namespace {

constexpr double kWidth_px = 560;
/// Off the planes in which corners like to lie.
constexpr double kOff_m = 3.7e-7;

/// Turned so that the section's normal is z, the picture's right x and up y.
Eigen::Matrix3d PictureAxes(int axis) {
  Eigen::Matrix3d rotation;
  if (axis == 0) {
    rotation << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  } else if (axis == 1) {
    rotation << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  } else {
    rotation.setIdentity();
  }
  return rotation;
}

std::vector<SlabLoop> Cut(const TriangleMesh& mesh, const Eigen::Vector3d& offset, int axis, double height) {
  Pose pose = Pose::Identity();
  pose.linear() = PictureAxes(axis);
  pose.translation() = pose.linear() * offset;
  return SectionAt(Transformed(mesh, pose), height + kOff_m);
}

class Sheet {
 public:
  explicit Sheet(const Eigen::AlignedBox2d& view) : view_(view), scale_(kWidth_px / view.sizes().x()) {}

  void Area(const std::vector<SlabLoop>& loops, const std::string& style) {
    std::string path;
    for (const SlabLoop& loop : loops) {
      for (std::size_t i = 0; i < loop.size(); ++i)
        path += fmt::format("{}{:.2f} {:.2f}", i == 0 ? "M" : "L", X(loop[i].middle.x()), Y(loop[i].middle.y()));
      path += "Z";
    }
    body_ += fmt::format("<path fill-rule=\"evenodd\" {} d=\"{}\"/>\n", style, path);
  }
  void Rectangle(const Eigen::AlignedBox2d& box, const std::string& style) {
    body_ += fmt::format("<rect x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\" {}/>\n", X(box.min().x()),
                         Y(box.max().y()), scale_ * box.sizes().x(), scale_ * box.sizes().y(), style);
  }
  void Line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const std::string& style) {
    body_ += fmt::format("<line x1=\"{:.2f}\" y1=\"{:.2f}\" x2=\"{:.2f}\" y2=\"{:.2f}\" {}/>\n", X(a.x()), Y(a.y()),
                         X(b.x()), Y(b.y()), style);
  }
  /// Beside a place: it ends there where `anchor` is "end", and begins there where it is "start".
  void Label(const Eigen::Vector2d& at, const std::string& text, const std::string& anchor) {
    constexpr double kBeside_px = 8;
    body_ += fmt::format(
        "<text x=\"{:.2f}\" y=\"{:.2f}\" font-size=\"14\" font-family=\"sans-serif\" fill=\"#111\" text-anchor=\"{}\" "
        "stroke=\"#fff\" stroke-width=\"3\" paint-order=\"stroke\">{}</text>\n",
        X(at.x()) + (anchor == "end" ? -kBeside_px : kBeside_px), Y(at.y()) - 5, anchor, text);
  }
  std::string Finish() const {
    const double height = scale_ * view_.sizes().y();
    return fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:.0f} {1:.0f}\" width=\"{0:.0f}\" "
        "height=\"{1:.0f}\">\n"
        "<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n{2}</svg>\n",
        kWidth_px, height, body_);
  }

 private:
  double X(double x) const { return scale_ * (x - view_.min().x()); }
  double Y(double y) const { return scale_ * (view_.max().y() - y); }
  Eigen::AlignedBox2d view_;
  double scale_;
  std::string body_;
};

/// Where the part is cut open: in the middle, or through the opening that is nearest to it.
double PlaneThroughOpening(const Mating& mating, int axis) {
  double plane = 0;
  double nearest = std::numeric_limits<double>::infinity();
  for (const SlabLoop& loop : mating.openings) {
    const Eigen::AlignedBox2d bounds = BoundsOf(loop);
    if (bounds.min()[axis] < 0 && bounds.max()[axis] > 0) return 0;
    const double middle = bounds.center()[axis];
    if (std::abs(middle) >= nearest) continue;
    nearest = std::abs(middle);
    plane = middle;
  }
  return plane;
}

Eigen::AlignedBox2d OpeningIn(const Mating& mating, int across) {
  Eigen::AlignedBox2d box;
  for (const SlabLoop& loop : mating.openings) {
    const Eigen::AlignedBox2d bounds = BoundsOf(loop);
    box.extend(Eigen::Vector2d(bounds.min()[across], mating.opening_low_m));
    box.extend(Eigen::Vector2d(bounds.max()[across], mating.opening_high_m));
  }
  return box;
}

/// A gap between tool and target on a level line; `to` lies farther from the middle of the opening.
struct Gap {
  bool found = false;
  double from = 0;
  double to = 0;

  /// By how much it is not as wide as the clearance.
  double Off(double clearance) const { return std::abs(std::abs(to - from) - clearance); }
};
/// Of the changes between material of one and of the other the one that is as wide as the clearance, as nearly as any:
/// a hollow plug has another within.
Gap GapOnLine(const std::vector<SlabLoop>& tool, const std::vector<SlabLoop>& target, double level, double from,
              double to, double clearance) {
  Gap best;
  constexpr int kSteps = 20000;
  bool last_tool = false;
  bool last_target = false;
  double end = from;
  for (int i = 0; i <= kSteps; ++i) {
    const Eigen::Vector2d p(from + (to - from) * i / kSteps, level);
    const bool in_tool = IsMaterial(tool, p);
    const bool in_target = !in_tool && IsMaterial(target, p);
    if ((in_tool && last_target) || (in_target && last_tool)) {
      const Gap gap{true, end, p.x()};
      if (!best.found || gap.Off(clearance) < best.Off(clearance)) best = gap;
    }
    if (in_tool || in_target) {
      end = p.x();
      last_tool = in_tool;
      last_target = in_target;
    }
  }
  return best;
}

}  // namespace

std::string SectionSvg(const Mating& mating, const TriangleMesh& tool, const TriangleMesh& target,
                       const DrawingOptions& options) {
  const Eigen::Vector3d offset(0, 0, -options.tool_depth_m);
  const double height = options.axis == 2 ? -0.5 * mating.depth_m : PlaneThroughOpening(mating, options.axis);
  const std::vector<SlabLoop> tool_cut = Cut(tool, offset, options.axis, height);
  const std::vector<SlabLoop> target_cut = Cut(target, Eigen::Vector3d::Zero(), options.axis, height);
  const int across = options.axis == 0 ? 1 : 0;
  const double clearance = mating.clearance_m[across];
  Eigen::AlignedBox2d opening = options.axis == 2 ? Eigen::AlignedBox2d() : OpeningIn(mating, across);
  if (mating.tool_has_opening && !opening.isEmpty()) opening.translate(Eigen::Vector2d(0, -options.tool_depth_m));
  if (options.axis == 2) {
    for (const SlabLoop& loop : mating.openings) opening.extend(BoundsOf(loop));
  }
  if (opening.isEmpty()) {
    opening.extend(Eigen::Vector2d(mating.mating_box.min()[across], -mating.depth_m));
    opening.extend(Eigen::Vector2d(mating.mating_box.max()[across], 0));
  }
  const double level = options.axis == 2 ? opening.center().y() : -0.5 * mating.depth_m;
  // To the right, unless only the left has the clearance.
  const auto gap_at = [&](double y) {
    const double middle = opening.center().x();
    const Gap right = GapOnLine(tool_cut, target_cut, y, middle, middle + opening.sizes().x(), clearance);
    const Gap left = GapOnLine(tool_cut, target_cut, y, middle, middle - opening.sizes().x(), clearance);
    const bool take_left = left.found && (!right.found || left.Off(clearance) + 0.1 * clearance < right.Off(clearance));
    return take_left ? left : right;
  };
  const Gap gap = gap_at(level);
  Eigen::Vector2d center = opening.center();
  double span = 1.8 * std::max(opening.sizes().x(), 0.8 * opening.sizes().y());
  if (options.zoom) {
    span = std::max(12 * clearance, 5 * mating.lead_in_m[across]);
    // Where the one ends below the rim of the other, in the middle of the depth.
    const bool at_rim = options.axis != 2 && gap_at(-0.25 * span).found;
    center = {gap.found ? 0.5 * (gap.from + gap.to) : opening.max().x(), at_rim ? 0.0 : level};
  }
  const Eigen::Vector2d half(0.5 * span, 0.42 * span);
  Sheet sheet({center - half, center + half});
  // Below the parts: elsewhere the opening may be wider than in this plane.
  if (options.axis != 2 && !mating.openings.empty()) {
    sheet.Rectangle(opening, "fill=\"#e6501e\" fill-opacity=\"0.18\" stroke=\"#e6501e\" stroke-dasharray=\"5 3\"");
  }
  sheet.Area(target_cut, "fill=\"#7d8ea3\" stroke=\"#2d3a4c\" stroke-width=\"1\"");
  sheet.Area(tool_cut, "fill=\"#d9a441\" stroke=\"#6b4a10\" stroke-width=\"1\"");
  if (options.axis != 2)
    sheet.Line({center.x() - half.x(), 0}, {center.x() + half.x(), 0}, "stroke=\"#555\" stroke-dasharray=\"2 4\"");
  if (gap.found) {
    const double y = options.zoom && options.axis != 2 ? center.y() - 0.25 * span : level;
    sheet.Line({gap.from, y}, {gap.to, y}, "stroke=\"#c00\" stroke-width=\"2.5\"");
    sheet.Label({std::min(gap.from, gap.to), y}, fmt::format("clearance {:.3f} mm a side", 1000 * clearance), "end");
  }
  if (options.axis != 2) sheet.Label({center.x() - half.x(), 0}, "rim", "start");
  return sheet.Finish();
}

}  // namespace feeler::cad
