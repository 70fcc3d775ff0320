#include "feeler/cad/numbers/numbers.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "feeler/core/error.h"
#include "feeler/env/contact/lattice_phase.h"

namespace feeler::cad {
namespace {

constexpr double kFlangeToTool_m = 0.13;    // adapter, palm and fingers of the gripper (env/scene/gripper.h)
constexpr double kFingers_m = 0.016;        // how far they reach down over the tool
constexpr double kFingerRoom_m = 0.003;     // that stays between them and the target
constexpr double kFarthestSide_m = 0.08;    // farther sides are not worth the size of the contact map
constexpr double kLowestTarget_m = 0.2;     // of the mouth over the table: what the arm reaches well
constexpr double kTransferRoom_m = 0.0041;  // over what a transfer keeps clear (env/robot/transfer_checker.h)
constexpr int kMostCells = 64;

std::string Plain(double value) {
  std::string text = fmt::format("{:.7f}", value);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text == "-0" ? "0" : text;
}

std::string Plain(const Eigen::Vector3d& v) { return Plain(v.x()) + " " + Plain(v.y()) + " " + Plain(v.z()); }

/// One number where both agree within a hundredth, else one per axis.
std::string OneOrEach(const Eigen::Vector2d& v) {
  if (v.minCoeff() >= 0.99 * v.maxCoeff()) return Plain(v.minCoeff());
  return Plain(v.x()) + " " + Plain(v.y());
}

std::string Repeated(const std::string& value, std::size_t count) {
  std::string text = value;
  for (std::size_t i = 1; i < count; ++i) text += " " + value;
  return text;
}

/// How a lattice of such cells is laid between the walls across an axis.
env::LatticePhase PhaseAt(const std::vector<double>& walls_m, double cell_m) {
  std::vector<double> cells;
  for (const double wall : walls_m) cells.push_back(wall / cell_m);
  return env::ChoosePhase(cells);
}

double MarginAt(const Walls& walls, double cell_m) {
  double margin = 0.5;
  for (const std::vector<double>& along : walls) margin = std::min(margin, PhaseAt(along, cell_m).margin);
  return margin;
}

struct CellChoice {
  double cell_m;
  double margin;
  double best_margin;
};

/// Of the cells from 0.5 to 2 mm whose walls stay three tenths of a cell off lattice planes, that with the largest
/// distance in millimetres; where there is none, the cell with the best margin.
CellChoice ChooseCell(const Walls& walls, const Eigen::Vector3d& uncertainty_m) {
  constexpr double kComfortable = 0.3;
  CellChoice most_room{0, 0, 0};
  CellChoice best{0, -1, 0};
  for (int step = 200; step >= 50; --step) {
    const double cell = step * 1e-5;
    if (std::ceil(2 * uncertainty_m.maxCoeff() / cell - 1e-9) > kMostCells) continue;
    const double margin = MarginAt(walls, cell);
    if (margin > best.margin + 1e-9) best = {cell, margin, 0};
    if (margin >= kComfortable && margin * cell > most_room.margin * most_room.cell_m + 1e-12)
      most_room = {cell, margin, 0};
  }
  CellChoice choice = most_room.cell_m > 0 ? most_room : best;
  if (choice.cell_m == 0) {
    // An uncertainty too large for these cells.
    choice.cell_m = std::ceil(2 * uncertainty_m.maxCoeff() / kMostCells * 1e4) * 1e-4;
    choice.margin = best.margin = MarginAt(walls, choice.cell_m);
  }
  choice.best_margin = best.margin;
  return choice;
}

class Derivation {
 public:
  Derivation(const Mating& mating, const TriangleMesh& tool, const TriangleMesh& target, const Walls& walls,
             const NumberOptions& options)
      : mating_(mating),
        tool_(BoundsOf(tool)),
        target_(BoundsOf(target)),
        walls_(walls),
        options_(options),
        tool_mesh_(tool) {}

  DerivedNumbers Run() {
    Axes();
    Motion();
    Insertion();
    Verdict();
    Holding();
    for (const auto& [field, value] : options_.overrides) {
      if (!used_.contains(field)) {
        throw InputError(fmt::format("--set {}={}", field, value), "is not a field that an import writes",
                         "the fields are listed in docs/task-file.md");
      }
    }
    return result_;
  }

 private:
  std::string Add(const std::string& field, bool text, std::string value, std::string reason) {
    if (const auto given = options_.overrides.find(field); given != options_.overrides.end()) {
      reason = fmt::format("given (--set); derived would be {}: {}", value, reason);
      value = given->second;
      used_[field] = true;
    }
    result_.fields.push_back({field, text, value, reason});
    return value;
  }
  /// The first number of a field as it stands, so that an override is what the others are derived from.
  static double First(const std::string& value) { return std::strtod(value.c_str(), nullptr); }

  void Axes() {
    const char* names[] = {"x", "y", "z"};
    std::string axes;
    for (int k = 0; k < 3; ++k) {
      if (options_.uncertainty_m[k] <= 0) continue;
      axes += (axes.empty() ? "" : " ") + std::string(names[k]);
      uncertain_.push_back(k);
    }
    if (uncertain_.empty())
      throw InputError("--uncertainty", "no axis is uncertain", "give three half widths, e.g. 6mm,6mm,4mm");
    const std::string given = options_.uncertainty_source.empty() ? "assumed, for nothing was given (--uncertainty)"
                                                                  : options_.uncertainty_source;
    const std::string widths = fmt::format("+-({}) mm", Plain(Eigen::Vector3d(options_.uncertainty_m * 1000)));
    Add("feeler_axes", true, axes, fmt::format("position uncertain by {} along x, y, z, {}", widths, given));
    const CellChoice choice = ChooseCell(walls_, options_.uncertainty_m);
    const std::string cell = Add("feeler_resolution", false, Repeated(Plain(choice.cell_m), uncertain_.size()),
                                 fmt::format("scanned from 0.5 to 2 mm: the cell whose walls stay farthest from "
                                             "lattice planes, {:.2f} cells (best margin {:.2f})",
                                             choice.margin, choice.best_margin));
    result_.cell_m = First(cell);
    if (!(result_.cell_m > 0))
      throw InputError("--set feeler_resolution", "is not positive", "give metres, e.g. 0.001");
    result_.margin_cells = MarginAt(walls_, result_.cell_m);
    std::string most;
    std::string least;
    std::string why;
    for (const int k : uncertain_) {
      const int count =
          std::clamp(static_cast<int>(std::ceil(2 * options_.uncertainty_m[k] / result_.cell_m - 1e-9)), 1, kMostCells);
      result_.cells.push_back(count);
      most += (most.empty() ? "" : " ") + std::to_string(count);
      least += (least.empty() ? "" : " ") + std::to_string(std::min(2, count));
      why += fmt::format("{}{} x {} mm >= 2 x {} mm", why.empty() ? "" : ", ", count, Plain(result_.cell_m * 1000),
                         Plain(options_.uncertainty_m[k] * 1000));
    }
    Add("feeler_min_cells", false, least, "smaller beliefs are met as well");
    const std::string cells = Add("feeler_max_cells", false, most, "covers the uncertainty: " + why);
    const char* at = cells.c_str();
    for (int& count : result_.cells) {
      char* end = nullptr;
      count = std::max(1, static_cast<int>(std::strtol(at, &end, 10)));
      at = end;
    }
  }

  double Range(int axis) const {
    for (std::size_t i = 0; i < uncertain_.size(); ++i) {
      if (uncertain_[i] == axis) return (result_.cells[i] - 1) * result_.cell_m;
    }
    return 0;
  }

  /// How much lower than its offset says the start may be: the lattice is laid between the walls that are met.
  double LatticeLower() const {
    const auto z = std::ranges::find(uncertain_, 2);
    if (z == uncertain_.end()) return 0;
    const bool even = result_.cells[static_cast<std::size_t>(z - uncertain_.begin())] % 2 == 0;
    if (even || walls_[2].empty()) return 0.5 * result_.cell_m;
    return std::max(0.0, -PhaseAt(walls_[2], result_.cell_m).phase) * result_.cell_m;
  }

  void Motion() {
    const double c = result_.cell_m;
    const auto up = [&](double value) { return c * std::ceil(value / c - 1e-9); };
    const double top = std::max(target_.max().z(), 0.0);
    // Transfers keep clear of targets up to half a cell beyond the hypotheses.
    const double room = std::max(3 * c, LatticeLower() + 0.5 * c + kTransferRoom_m);
    const double start = up(top + 0.5 * Range(2) + room);
    Add("feeler_start_offset", false, Plain(Eigen::Vector3d(0, 0, start)),
        fmt::format("top of the target {} mm over the mouth, half the range of heights {} mm, {}", Plain(1000 * top),
                    Plain(500 * Range(2)),
                    room > 3 * c ? Plain(1000 * room) + " mm for the transfer, which keeps 4 mm clear" : "3 cells"));
    Eigen::Vector3d low;
    Eigen::Vector3d high;
    for (int k = 0; k < 2; ++k) {
      const char* name = k == 0 ? "x" : "y";
      low[k] = target_.min()[k] - tool_.max()[k] - 0.5 * Range(k) - 2 * c;
      high[k] = target_.max()[k] - tool_.min()[k] + 0.5 * Range(k) + 2 * c;
      if (low[k] < -kFarthestSide_m || high[k] > kFarthestSide_m) {
        result_.warnings.push_back(
            fmt::format("the sides of the target along {} lie up to {:.0f} mm away: the nearer {:.0f} mm are felt",
                        name, 1000 * std::max(-low[k], high[k]), 1000 * kFarthestSide_m));
      }
      low[k] = std::max(low[k], -kFarthestSide_m);
      high[k] = std::min(high[k], kFarthestSide_m);
    }
    lowest_ = std::min(0.0, top - 4 * c) - 0.5 * Range(2) - 2 * c;
    low.z() = lowest_;
    high.z() = start + c;
    Eigen::Vector3d center = 0.5 * (low + high) - Eigen::Vector3d(0, 0, start);
    Eigen::Vector3d half = 0.5 * (high - low);
    for (int k = 0; k < 3; ++k) half[k] = up(half[k]);
    for (int k = 0; k < 3; ++k) center[k] = c * std::round(center[k] / c);
    Add("feeler_workspace", false, Plain(half),
        "past the sides of the target under every hypothesis: half of tool, target and range, and 2 cells");
    if (!center.isZero() || options_.overrides.contains("feeler_workspace_center")) {
      Add("feeler_workspace_center", false, Plain(center),
          "from the start: down to 4 cells below the top of the target");
    }
    Add("feeler_move_lengths", false, "1 2 4 8 16", "powers of two reach every distance in few moves");
  }

  void Insertion() {
    Add("feeler_insertion_axis", true, "-z", "the target frame is laid so: +z comes out of the mouth");
    Add("feeler_insertion_depth", false, Plain(Depth()),
        mating_.through
            ? fmt::format(
                  "the hole goes through: nothing stops the tool, {:.3f} mm is how long the parts are in each other",
                  1000 * mating_.depth_m)
            : fmt::format("measured by sliding: the tool stops {:.3f} mm below the mouth; rounded down",
                          1000 * mating_.depth_m));
  }

  double Depth() const { return std::floor((mating_.depth_m + 1e-9) * 1e5) * 1e-5; }

  void Verdict() {
    const Eigen::Vector2d reach = mating_.clearance_m + mating_.lead_in_m;
    const Eigen::Vector2d lateral = (0.95e6 * mating_.mouth_play_m).array().floor() * 1e-6;
    Add("feeler_tolerance_lateral", false, OneOrEach(lateral),
        fmt::format("0.95 of what enters along both axes at once ({:.4f} x {:.4f} mm); clearance {:.4f} x {:.4f} mm a "
                    "side, with lead-in {:.4f} x {:.4f} mm",
                    1000 * mating_.mouth_play_m.x(), 1000 * mating_.mouth_play_m.y(), 1000 * mating_.clearance_m.x(),
                    1000 * mating_.clearance_m.y(), 1000 * reach.x(), 1000 * reach.y()));
    const double vertical = std::min(0.002, 0.2 * Depth());
    Add("feeler_tolerance_vertical", false, Plain(vertical), "a fifth of the depth, 2 mm at most");
    // Tilted by this, the tool takes up its clearance over the depth; 0.03 is what a good gripper holds.
    const double tilt = std::clamp(2 * mating_.clearance_m.minCoeff() / Depth(), 0.01, 0.05);
    Add("feeler_tolerance_angle", false, Plain(std::round(tilt * 1e4) * 1e-4),
        "clearance over depth, both sides, within 0.01 and 0.05");
    ForceBudget();
    Add("feeler_cost", false, "1 0 0", "distance");
    Add("feeler_goal", true, "singleton", "one hypothesis left: the tightest a lattice tells");
  }

  /// What of the tool faces the target within kTip_m of its tip, m^2; the tool's width and depth there if no triangle
  /// does (a point, a round end).
  double TipArea() const {
    constexpr double kTip_m = 5e-4;
    double area_m2 = 0.0;
    Box tip;
    for (int t = 0; t < tool_mesh_.size(); ++t) {
      const Box box = BoundsOf(tool_mesh_, t);
      if (box.min().z() > tool_.min().z() + kTip_m) continue;
      if (box.max().z() <= tool_.min().z() + kTip_m) {
        area_m2 += std::max(0.0, -AreaVector(tool_mesh_, t).z());
        tip.extend(box);
      }
    }
    if (area_m2 > 0.0) return area_m2;
    return tip.isEmpty() ? 1e-6 : std::max(1e-6, tip.sizes().x() * tip.sizes().y());
  }

  void ForceBudget() {
    constexpr double kMost_n = 25.0;  // what public benchmarks of insertion allow
    constexpr double kLeast_n = 6.0;  // 1.2 of what the force sensor tells contact by
    constexpr double kShare = 0.2;    // of the yield pressure
    const double tip_mm2 = 1e6 * TipArea();
    const double yield_mpa = 1e-6 * options_.material.yield_pa;
    const double bears_n = kShare * yield_mpa * tip_mm2;
    const double budget_n = std::floor(std::clamp(bears_n, kLeast_n, kMost_n));
    Add("feeler_force_budget", false, Plain(budget_n),
        fmt::format(
            "{:.0f} N at most, as benchmarks of insertion ask; a fifth of what {} yields at ({:g} MPa) over the "
            "{:.1f} mm2 of the tip is {:.0f} N",
            kMost_n, options_.material.name, yield_mpa, tip_mm2, bears_n));
    if (bears_n < kLeast_n) {
      result_.warnings.push_back(
          fmt::format("the tip is small: {:.0f} N, the least that touch can do with, press {:.0f} MPa on it, and {} "
                      "yields at {:g}",
                      kLeast_n, kLeast_n / tip_mm2, options_.material.name, yield_mpa));
    }
  }

  /// The part of the tool that fingers would hold.
  Box Grip(double length) const {
    Box grip;
    for (int t = 0; t < tool_mesh_.size(); ++t) {
      const Box box = BoundsOf(tool_mesh_, t);
      if (box.max().z() > length - std::min(kFingers_m, 0.4 * length)) grip.extend(box);
    }
    return grip;
  }

  void Holding() {
    double length = tool_.max().z();
    // Fingers stay clear of the target at the lowest place the tool goes to, and when it is in.
    const double lowest = std::max(-lowest_, Depth());
    const double needed = std::max(target_.max().z(), 0.0) + lowest + kFingers_m + kFingerRoom_m;
    const Box grip = Grip(length);
    Eigen::Vector3d center = grip.center();
    std::string held =
        fmt::format("the tool is {:.1f} mm long, {:.1f} are needed for 16 mm of fingers and the way down",
                    1000 * length, 1000 * needed);
    if (length < needed) {
      // Where the target comes out on top of the tool, the handle stands above it.
      const double through = std::max(target_.max().z() + Depth(), length);
      const double from = through > length + 1e-6 ? through + 0.002 : length;
      const double to = std::max(needed, from + 0.02);
      const double half = std::clamp(0.35 * grip.sizes().head<2>().minCoeff(), 0.003, 0.008);
      result_.handle = Handle{{center.x(), center.y(), 0.5 * (from + to)}, {half, half, 0.5 * (to - from)}};
      held += fmt::format("; a handle of {:.0f} mm stands for what your gripper holds it by", 1000 * (to - from));
      result_.warnings.push_back(
          fmt::format("the tool is too short for the fingers: a handle from {:.1f} to {:.1f} mm over its tip is added",
                      1000 * from, 1000 * to));
      length = to;
    } else if (grip.sizes().x() > 0.1) {
      result_.warnings.push_back(
          fmt::format("the tool is {:.0f} mm wide where the fingers hold it", 1000 * grip.sizes().x()));
    }
    // Turned upside down: x stays, y and z change sign.
    const auto tidy = [](double v) { return std::abs(v) < 1e-9 ? 0.0 : v; };
    Add("feeler_flange_position", false,
        Plain(Eigen::Vector3d(tidy(-center.x()), tidy(center.y()), kFlangeToTool_m + length)),
        "0.13 m from flange to fingers' room, and the tool: " + held);
    Add("feeler_flange_quaternion", false, "0 1 0 0", "the tool's -z is the flange's +z");
    const double below = std::max(-target_.min().z(), mating_.through ? Depth() : 0.0);
    result_.target_height_m = std::max(kLowestTarget_m, std::ceil((below + 0.03) * 100) / 100);
  }

  const Mating& mating_;
  Box tool_;
  Box target_;
  const Walls& walls_;
  const NumberOptions& options_;
  const TriangleMesh& tool_mesh_;
  std::vector<int> uncertain_;
  double lowest_ = 0;
  std::map<std::string, bool> used_;
  DerivedNumbers result_;
};

}  // namespace

Material ParseMaterial(const std::string& name) {
  // Densities, friction and yield from handbooks; the contact time is what keeps 1 ms steps stable, stiffer for metals.
  const std::vector<Material> known = {{"aluminium", 2700, 0.3, 0.01, 2.4e8}, {"steel", 7850, 0.2, 0.008, 2.5e8},
                                       {"brass", 8500, 0.25, 0.008, 2e8},     {"abs", 1050, 0.3, 0.01, 4e7},
                                       {"nylon", 1150, 0.25, 0.012, 5e7},     {"rubber", 1200, 0.8, 0.03, 5e6}};
  std::string names;
  for (const Material& material : known) {
    if (material.name == name) return material;
    names += (names.empty() ? "" : ", ") + material.name;
  }
  throw InputError("--material", fmt::format("unknown material \"{}\"", name), "choose one of " + names);
}

DerivedNumbers DeriveNumbers(const Mating& mating, const TriangleMesh& tool, const TriangleMesh& target,
                             const Walls& walls, const NumberOptions& options) {
  return Derivation(mating, tool, target, walls, options).Run();
}

}  // namespace feeler::cad
