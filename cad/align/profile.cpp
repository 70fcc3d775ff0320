#include "feeler/cad/align/profile.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace feeler::cad {
namespace {

constexpr std::size_t kBins = 1440;
/// A line whose radius differs by less than this share is round.
constexpr double kRound = 0.01;
/// Turns nearer than this are one.
constexpr double kApart_rad = 4.0 * std::numbers::pi / 180;
/// Room that differs by less is the same.
constexpr double kSameRoom_m = 2e-5;
/// Sides come to lie parallel within this of a turn.
constexpr double kNear_rad = 2.0 * std::numbers::pi / 180;

Eigen::Vector2d MiddleOf(const SlabLoop& loop) {
  const Eigen::Vector2d origin = loop.front().middle;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double twice = 0;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const Eigen::Vector2d a = loop[i].middle - origin;
    const Eigen::Vector2d b = loop[(i + 1) % loop.size()].middle - origin;
    const double cross = a.x() * b.y() - a.y() * b.x();
    twice += cross;
    sum += cross * (a + b);
  }
  if (twice == 0) return origin;
  return origin + sum / (3 * twice);
}

double Folded(double angle, double period) { return angle - period * std::floor(angle / period); }
/// Into -period/2 .. period/2.
double Centred(double angle, double period) { return angle - period * std::round(angle / period); }

/// Where the line from the origin at an angle meets the side a b; nothing where they are parallel.
double RadiusAt(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double angle) {
  const Eigen::Vector2d way(std::cos(angle), std::sin(angle));
  const Eigen::Vector2d side = b - a;
  const double across = way.x() * side.y() - way.y() * side.x();
  if (std::abs(across) < 1e-15) return a.norm();
  return (a.x() * side.y() - a.y() * side.x()) / across;
}

double DistanceTo(const std::vector<Eigen::Vector2d>& line, const Eigen::Vector2d& p, bool& inside) {
  double best = std::numeric_limits<double>::infinity();
  inside = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const Eigen::Vector2d& a = line[i];
    const Eigen::Vector2d& b = line[i + 1 == line.size() ? 0 : i + 1];
    const Eigen::Vector2d side = b - a;
    const double length = side.squaredNorm();
    const double share = length > 0 ? std::clamp((p - a).dot(side) / length, 0.0, 1.0) : 0.0;
    best = std::min(best, (p - a - share * side).squaredNorm());
    if ((a.y() > p.y()) != (b.y() > p.y()) && p.x() < a.x() + (p.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x()))
      inside = !inside;
  }
  return std::sqrt(best);
}

struct Side {
  double angle;
  double length;
};

std::vector<Side> SidesOf(const SlabLoop& loop) {
  constexpr double kCorner_rad = 15 * std::numbers::pi / 180;
  constexpr double kLong = 0.08;
  const std::size_t count = loop.size();
  std::vector<Eigen::Vector2d> edges;
  double perimeter = 0;
  for (std::size_t i = 0; i < count; ++i) {
    edges.emplace_back(loop[(i + 1) % count].middle - loop[i].middle);
    perimeter += edges.back().norm();
  }
  const auto turns = [&](std::size_t i) {  // from edge i to the next
    const Eigen::Vector2d& a = edges[i];
    const Eigen::Vector2d& b = edges[(i + 1) % count];
    return std::abs(std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b))) > kCorner_rad;
  };
  std::vector<Side> sides;
  for (std::size_t i = 0; i < count; ++i) {
    const double length = edges[i].norm();
    if (length > kLong * perimeter || (turns(i) && turns((i + count - 1) % count) && length > 0.005 * perimeter))
      sides.push_back({std::atan2(edges[i].y(), edges[i].x()), length});
  }
  return sides;
}

}  // namespace

Profile ProfileOf(const SlabLoop& loop) {
  Profile profile;
  profile.middle = MiddleOf(loop);
  profile.farthest_m.assign(kBins, 0.0);
  profile.nearest_m.assign(kBins, std::numeric_limits<double>::infinity());
  constexpr double kBin = 2 * std::numbers::pi / kBins;
  constexpr double kAtCorner = 1e-6;  // of a bin: far more than rounding
  const auto extend = [&](std::size_t bin, double radius) {
    profile.farthest_m[bin % kBins] = std::max(profile.farthest_m[bin % kBins], radius);
    profile.nearest_m[bin % kBins] = std::min(profile.nearest_m[bin % kBins], radius);
  };
  for (std::size_t i = 0; i < loop.size(); ++i) {
    Eigen::Vector2d a = loop[i].middle - profile.middle;
    Eigen::Vector2d b = loop[(i + 1) % loop.size()].middle - profile.middle;
    // A ray through a corner may be taken for beyond both sides that meet there.
    const double corner = Folded(std::atan2(a.y(), a.x()), 2 * std::numbers::pi) / kBin;
    if (std::abs(corner - std::round(corner)) < kAtCorner)
      extend(static_cast<std::size_t>(std::round(corner)), a.norm());
    if (a.x() * b.y() - a.y() * b.x() < 0) std::swap(a, b);
    const double from = Folded(std::atan2(a.y(), a.x()), 2 * std::numbers::pi);
    const double turn = std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b));
    const auto end = static_cast<std::size_t>(std::ceil((from + turn) / kBin));
    for (auto bin = static_cast<std::size_t>(std::ceil(from / kBin)); bin < end; ++bin)
      extend(bin, RadiusAt(a, b, static_cast<double>(bin) * kBin));
  }
  for (double& radius : profile.nearest_m) radius = std::isfinite(radius) ? radius : 0.0;
  profile.farthest_sorted_m = profile.farthest_m;
  profile.nearest_sorted_m = profile.nearest_m;
  std::sort(profile.farthest_sorted_m.begin(), profile.farthest_sorted_m.end());
  std::sort(profile.nearest_sorted_m.begin(), profile.nearest_sorted_m.end());
  const double most = profile.farthest_sorted_m.back();
  profile.round = most - profile.nearest_sorted_m.front() < kRound * most;
  return profile;
}

namespace {

/// Whether some turn may do: what is inside at every angle is so, too, when both are put in order of their size.
bool MayFit(const Profile& inner, const Profile& outer, double least_m) {
  for (std::size_t i = 0; i < kBins; ++i) {
    if (outer.nearest_sorted_m[i] - inner.farthest_sorted_m[i] < least_m) return false;
  }
  return true;
}

}  // namespace

std::vector<double> TurnsInto(const Profile& inner, const Profile& outer, std::size_t most) {
  if (inner.round || outer.round || inner.farthest_sorted_m.back() <= outer.nearest_sorted_m.front()) return {};
  const double least = -kFarOut_m;
  if (!MayFit(inner, outer, least)) return {};
  std::vector<double> room(kBins, least);
  // Angles far from each other in turn: most that do not fit are found out soon.
  constexpr std::size_t kStride = 397;
  for (std::size_t k = 0; k < kBins; ++k) {
    double here = std::numeric_limits<double>::infinity();
    for (std::size_t n = 0, i = 0; n < kBins && here > least; ++n, i = (i + kStride) % kBins) {
      const std::size_t at = i + k < kBins ? i + k : i + k - kBins;
      here = std::min(here, outer.nearest_m[at] - inner.farthest_m[i]);
    }
    room[k] = std::max(here, least);
  }
  std::vector<std::size_t> order;
  for (std::size_t k = 0; k < kBins; ++k) {
    const double before = room[(k + kBins - 1) % kBins];
    const double after = room[(k + 1) % kBins];
    if (room[k] > least && room[k] >= before && room[k] >= after) order.push_back(k);
  }
  const auto way = [](std::size_t k) { return std::min(k, kBins - k); };
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    const double x = std::floor(room[a] / kSameRoom_m);
    const double y = std::floor(room[b] / kSameRoom_m);
    return x != y ? x > y : way(a) < way(b);
  });
  std::vector<double> turns;
  for (const std::size_t k : order) {
    const double turn = 2 * std::numbers::pi * static_cast<double>(k) / kBins;
    const bool known = std::any_of(turns.begin(), turns.end(), [&](double t) {
      return std::abs(Centred(turn - t, 2 * std::numbers::pi)) < kApart_rad;
    });
    if (!known) turns.push_back(turn);
    if (turns.size() == most) break;
  }
  return turns;
}

double WithParallelSides(const SlabLoop& inner, const SlabLoop& outer, double turn_rad, bool& found) {
  constexpr double kOne_rad = 3e-4;
  std::vector<Side> steps;  // from the turn to one with parallel sides, and how long they are
  for (const Side& a : SidesOf(inner)) {
    for (const Side& b : SidesOf(outer)) {
      const double step = Centred(b.angle - a.angle - turn_rad, std::numbers::pi);
      if (std::abs(step) < kNear_rad) steps.push_back({step, std::min(a.length, b.length)});
    }
  }
  found = !steps.empty();
  double best = 0;
  double longest = 0;
  double length = 0;
  for (const Side& step : steps) {
    double sum = 0;
    for (const Side& other : steps) sum += std::abs(other.angle - step.angle) < kOne_rad ? other.length : 0.0;
    // Of those that agree the longest side's, whose direction is known best.
    if (sum < length - 1e-9 || (sum <= length + 1e-9 && step.length <= longest + 1e-9)) continue;
    best = step.angle;
    length = sum;
    longest = step.length;
  }
  return turn_rad + best;
}

double Room(const std::vector<Eigen::Vector2d>& inner, const std::vector<Eigen::Vector2d>& outer, double least_m) {
  double room = std::numeric_limits<double>::infinity();
  bool inside = false;
  for (std::size_t i = 0; i < inner.size() && room >= least_m; ++i) {
    const double distance = DistanceTo(outer, inner[i], inside);
    room = std::min(room, inside ? distance : -distance);
  }
  for (std::size_t i = 0; i < outer.size() && room >= least_m; ++i) {
    const double distance = DistanceTo(inner, outer[i], inside);
    room = std::min(room, inside ? -distance : distance);
  }
  return room;
}

Centered MostRoom(const std::vector<Eigen::Vector2d>& inner, const std::vector<Eigen::Vector2d>& outer,
                  double reach_m) {
  Centered best{Eigen::Vector2d::Zero(), Room(inner, outer, -reach_m)};
  std::vector<Eigen::Vector2d> moved = inner;
  for (double step = 0.5 * reach_m; step > 1e-6;) {
    Centered better = best;
    for (int k = 0; k < 8; ++k) {
      const Eigen::Vector2d move =
          best.move + step * Eigen::Vector2d(std::cos(k * std::numbers::pi / 4), std::sin(k * std::numbers::pi / 4));
      if (move.norm() > reach_m) continue;
      for (std::size_t i = 0; i < inner.size(); ++i) moved[i] = inner[i] + move;
      const double room = Room(moved, outer, better.room_m);
      if (room > better.room_m + 1e-9) better = {move, room};
    }
    if (better.room_m > best.room_m) {
      best = better;
    } else {
      step *= 0.5;
    }
  }
  return best;
}

}  // namespace feeler::cad
