#include "feeler/cad/align/trials.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "feeler/cad/align/profile.h"

namespace feeler::cad {
namespace {

/// Angles by which radii fit, or several lines lie over several holes, are looked at up to this many.
constexpr std::size_t kMostTurns = 6;
/// Lines whose distances differ by more do not lie over holes all at once.
constexpr double kSameDistance_m = 3e-4;

/// Parts with less play across have none.
constexpr double kNoPlay_m = 1e-6;

struct Turn {
  double roll_rad;
  bool about;   ///< to be found exactly when the tool is in
  bool common;  ///< one of those that are tried of every pair
};

/// `with_ends`: of the whole slab, not of its middle alone.
Eigen::AlignedBox2d RolledBounds(const SlabLoop& loop, double roll, bool with_ends = false) {
  const Eigen::Rotation2Dd rotation(roll);
  Eigen::AlignedBox2d box;
  for (const SlabPoint& p : loop) {
    box.extend(rotation * p.middle);
    if (!with_ends) continue;
    box.extend(rotation * p.low);
    box.extend(rotation * p.high);
  }
  return box;
}

/// The box around all material up to the upper end of a feature: where the tip is narrower than what follows (a latch),
/// it is this that has to come into the hole.
Eigen::AlignedBox2d TipBounds(const std::vector<Feature>& features, const Feature& upto, double roll) {
  Eigen::AlignedBox2d box;
  for (const Feature& feature : features) {
    if (!feature.hole && feature.low_m < upto.high_m - 1e-9) box.extend(RolledBounds(feature.loop, roll, true));
  }
  return box;
}

/// A taper goes into a taper as deep as it will: what has to fit is the tool's lower end into the target's upper.
/// (Their middles tell nothing, for the two are seldom equally long.)
struct Ends {
  const SlabLoop& tool;
  const SlabLoop& target;
  bool tapers;
};
Ends EndsThatMeet(const Feature& tool, const Feature& target) {
  const int narrow_below = tool.hole ? -1 : 1;  // a tip narrows downwards, the hole of a tool upwards
  const bool tapers = tool.tapers == narrow_below && target.tapers == narrow_below;
  if (!tapers) return {tool.loop, target.loop, false};
  return {tool.low_loop, target.high_loop, true};
}

/// The corners of a line, fewer where it has very many.
std::vector<Eigen::Vector2d> OutlineOf(const SlabLoop& loop) {
  constexpr std::size_t kMany = 48;
  const SlabLoop simple = loop.size() > kMany ? Simplified(loop, [](const SlabPoint&) { return 3e-6; }) : loop;
  std::vector<Eigen::Vector2d> outline;
  for (const SlabPoint& p : simple) outline.push_back(p.middle);
  return outline;
}

/// The trials of one direction of the tool with one of the target.
class Pairing {
 public:
  Pairing(const std::vector<Feature>& tool, const std::vector<Feature>& target, std::size_t a, std::size_t b)
      : tool_(tool), target_(target), a_(a), b_(b) {
    for (const Feature& f : tool_) {
      for (const Feature& g : target_) {
        if (f.hole == g.hole || g.high_m - g.low_m < kLeastEngaged_m) continue;
        const double fit = FitOf(f, g);
        if (fit >= 0.25 && fit <= 1.15) matches_.push_back({&f, &g, fit});
      }
    }
  }

  void Run(std::vector<Trial>& trials, Miss& miss) const {
    for (const Match& match : matches_) {
      const Ends ends = EndsThatMeet(*match.tool, *match.target);
      const Outlines outlines{OutlineOf(ends.tool), OutlineOf(ends.target)};
      std::optional<double> room;  // of what is round, at every turn
      for (const Turn& turn : TurnsOf(match)) Add(match, outlines, turn, room, trials, miss);
    }
  }

 private:
  struct Match {
    const Feature* tool;
    const Feature* target;
    double fit;
  };

  struct Outlines {
    std::vector<Eigen::Vector2d> tool;
    std::vector<Eigen::Vector2d> target;
  };

  /// Area of what goes in over that of the hole; of two tapers that of their ends, if they are alike.
  static double FitOf(const Feature& f, const Feature& g) {
    constexpr double kAlike = 0.25;
    const Ends ends = EndsThatMeet(f, g);
    if (!ends.tapers) return f.hole ? g.area / f.area : f.area / g.area;
    const double a = SlopeOf(f);
    const double b = SlopeOf(g);
    if (std::abs(a - b) > kAlike * std::max(a, b)) return 0;
    const double tool = std::abs(SignedArea(ends.tool));
    const double target = std::abs(SignedArea(ends.target));
    return std::min(f.hole ? target / tool : tool / target, 1.0);
  }

  /// How fast the width of a taper grows with its height.
  static double SlopeOf(const Feature& feature) {
    const double low = std::sqrt(std::abs(SignedArea(feature.low_loop)));
    const double high = std::sqrt(std::abs(SignedArea(feature.high_loop)));
    return std::abs(high - low) / (feature.high_m - feature.low_m);
  }

  /// How many lines of the tool, apart from each other, lie over holes that are made for them, or the other way round.
  int HeldAt(const Match& match, double roll, const Eigen::Vector2d& place) const {
    constexpr double kApart_m = 1e-3;
    const Eigen::Rotation2Dd rotation(roll);
    std::vector<Eigen::Vector2d> held;
    for (const Match& other : matches_) {
      if (other.tool->hole != match.tool->hole || other.fit > 1) continue;
      const Eigen::Vector2d at = rotation * other.tool->profile.middle + place;
      if ((at - other.target->profile.middle).norm() > kSameDistance_m) continue;
      const bool known =
          std::any_of(held.begin(), held.end(), [&](const auto& h) { return (h - at).norm() < kApart_m; });
      if (!known) held.push_back(at);
    }
    return static_cast<int>(held.size());
  }

  /// Not the walls of what mates, but a tip, a lead-in, or what is cut aslant.
  static bool IsSteep(const Feature& feature) {
    constexpr double kSteep = 0.2;
    constexpr double kLeans = 0.1;
    return feature.lean > kLeans || (feature.tapers != 0 && SlopeOf(feature) > kSteep);
  }

  /// Parts that mate do so along walls that lie along the way in, or taper alike; by chance others fit.
  static int RankOf(const Match& match, bool contained) {
    if (!contained) return 3;
    if (EndsThatMeet(*match.tool, *match.target).tapers) return 1;
    return match.tool->tapers == 0 && match.target->tapers == 0 ? 0 : 2;
  }

  std::vector<Turn> TurnsOf(const Match& match) const {
    const Feature& f = *match.tool;
    const Feature& g = *match.target;
    std::vector<Turn> turns;
    const auto add = [&](double roll, bool about, bool common) {
      roll -= 2 * std::numbers::pi * std::floor(roll / (2 * std::numbers::pi) + 1e-9);
      const bool known = std::any_of(turns.begin(), turns.end(), [&](const Turn& other) {
        const double apart = std::abs(other.roll_rad - roll);
        return std::min(apart, 2 * std::numbers::pi - apart) < 1e-4;
      });
      if (!known) turns.push_back({roll, about, common});
    };
    for (int k = 0; k < 4; ++k) add(k * std::numbers::pi / 2, false, true);
    if (f.has_edges && g.has_edges) {
      for (int k = 0; k < 4; ++k) add(g.edge_rad - f.edge_rad + k * std::numbers::pi / 2, false, true);
    }
    if (IsSteep(f) || IsSteep(g)) return turns;
    const auto [tool_loop, target_loop, tapers] = EndsThatMeet(f, g);
    const SlabLoop& inner = f.hole ? target_loop : tool_loop;
    const SlabLoop& outer = f.hole ? tool_loop : target_loop;
    for (const double turn : TurnsInto(f.hole ? g.profile : f.profile, f.hole ? f.profile : g.profile, kMostTurns)) {
      bool parallel = false;
      const double exact = WithParallelSides(inner, outer, turn, parallel);
      add(f.hole ? -exact : exact, !parallel, false);
    }
    for (const double roll : OverSeveral(match)) add(roll, false, false);
    return turns;
  }

  /// Turns under which other lines of the tool lie over other holes, too.
  std::vector<double> OverSeveral(const Match& match) const {
    constexpr double kLeastDistance_m = 1e-3;
    std::vector<double> rolls;
    for (const Match& other : matches_) {
      if (other.tool == match.tool || other.target == match.target || other.tool->hole != match.tool->hole) continue;
      const Eigen::Vector2d from = other.tool->profile.middle - match.tool->profile.middle;
      const Eigen::Vector2d to = other.target->profile.middle - match.target->profile.middle;
      if (from.norm() < kLeastDistance_m || std::abs(from.norm() - to.norm()) > kSameDistance_m) continue;
      const double roll = std::atan2(to.y(), to.x()) - std::atan2(from.y(), from.x());
      const bool known = std::any_of(rolls.begin(), rolls.end(), [&](double r) {
        return std::abs(std::remainder(r - roll, 2 * std::numbers::pi)) < 1e-3;
      });
      if (!known) rolls.push_back(roll);
      if (rolls.size() == kMostTurns) break;
    }
    return rolls;
  }

  void Add(const Match& match, const Outlines& outlines, const Turn& turn, std::optional<double>& round_room,
           std::vector<Trial>& trials, Miss& miss) const {
    const Feature& f = *match.tool;
    const Feature& g = *match.target;
    const double roll = turn.roll_rad;
    const Ends ends = EndsThatMeet(f, g);
    const Eigen::AlignedBox2d tool_box = RolledBounds(ends.tool, roll);
    const Eigen::AlignedBox2d target_box = BoundsOf(ends.target);
    const Eigen::Vector2d inner = f.hole ? target_box.sizes() : tool_box.sizes();
    const Eigen::Vector2d hole = f.hole ? tool_box.sizes() : target_box.sizes();
    const double too_wide = (inner - hole).maxCoeff();
    const bool misses = too_wide > 0 || match.fit > 1;
    if ((misses || too_wide > -kNoPlay_m) && match.fit > 0.6 && std::max(too_wide, 0.0) < miss.too_wide_m)
      miss = {std::max(too_wide, 0.0), inner, hole};
    if (misses) return;
    const bool round = f.profile.round && g.profile.round;
    const bool by_chance = (IsSteep(f) || IsSteep(g)) && !ends.tapers;
    const auto add = [&](const Eigen::Vector2d& at) {
      Eigen::Vector2d place = at;
      double room = -kFarOut_m;
      if (round && round_room) {
        room = *round_room;
      } else if (!by_chance) {
        room = RoomAt(outlines, f.hole, roll, place);
      }
      if (round && room > 0) round_room = room;
      if (!turn.common && room < -kFarOut_m) return;
      trials.push_back({a_, b_, roll, place, f.hole, g.high_m, g.low_m, inner.minCoeff(), match.fit,
                        RankOf(match, room > 0), HeldAt(match, roll, place), turn.about});
    };
    add(target_box.center() - tool_box.center());
    if (f.hole || ends.tapers || by_chance) return;
    const Eigen::AlignedBox2d tip = TipBounds(tool_, f, roll);
    if ((tip.sizes() - hole).maxCoeff() > 0 || (tip.center() - tool_box.center()).norm() < 1e-5) return;
    add(target_box.center() - tip.center());
  }

  /// The room that the inner line has at a place of the tool, which moves a little to where there is more.
  static double RoomAt(const Outlines& outlines, bool tool_is_outer, double roll, Eigen::Vector2d& place) {
    const Eigen::Rotation2Dd rotation(roll);
    std::vector<Eigen::Vector2d> tool = outlines.tool;
    for (Eigen::Vector2d& p : tool) p = rotation * p + place;
    const std::vector<Eigen::Vector2d>& target = outlines.target;
    const std::vector<Eigen::Vector2d>& inner = tool_is_outer ? target : tool;
    const std::vector<Eigen::Vector2d>& outer = tool_is_outer ? tool : target;
    const double room = Room(inner, outer, -kFarOut_m);
    if (room > 0 || room < -kFarOut_m) return room;
    const Centered centered = MostRoom(inner, outer, kFarOut_m);
    place += tool_is_outer ? Eigen::Vector2d(-centered.move) : centered.move;
    return centered.room_m;
  }

  const std::vector<Feature>& tool_;
  const std::vector<Feature>& target_;
  std::size_t a_;
  std::size_t b_;
  std::vector<Match> matches_;
};

}  // namespace

Turned TurnedPart(const TriangleMesh& mesh, const Eigen::Matrix3d& rotation) {
  Turned part;
  part.rotation = rotation;
  Pose pose = Pose::Identity();
  pose.linear() = rotation;
  part.mesh = Transformed(mesh, pose);
  part.features = FeaturesOf(part.mesh);
  return part;
}

std::vector<Trial> TrialsOf(const std::vector<Turned>& tools, const std::vector<Turned>& targets, Miss& miss) {
  std::vector<Trial> trials;
  for (std::size_t a = 0; a < tools.size(); ++a) {
    for (std::size_t b = 0; b < targets.size(); ++b)
      Pairing(tools[a].features, targets[b].features, a, b).Run(trials, miss);
  }
  std::stable_sort(trials.begin(), trials.end(), [](const Trial& x, const Trial& y) {
    if (x.rank != y.rank) return x.rank < y.rank;
    if (x.held != y.held) return x.held > y.held;
    return x.fit > y.fit + 1e-6;
  });
  // Lines above each other that lead to one place say the same.
  std::vector<Trial> distinct;
  for (const Trial& trial : trials) {
    const bool known = std::any_of(distinct.begin(), distinct.end(), [&](const Trial& other) {
      return other.tool == trial.tool && other.target == trial.target && other.low_m == trial.low_m &&
             other.high_m == trial.high_m && other.tool_has_opening == trial.tool_has_opening &&
             std::abs(other.roll_rad - trial.roll_rad) < 1e-6 && (other.place - trial.place).norm() < 1e-6;
    });
    if (!known) distinct.push_back(trial);
    if (distinct.size() == kMostTrials) break;
  }
  return distinct;
}

}  // namespace feeler::cad
