#include "feeler/cad/section/section.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <unordered_map>

namespace feeler::cad {
namespace {

struct Crossing {
  std::uint64_t edge;
  SlabPoint point;
};
struct Segment {
  Crossing from;
  Crossing to;
  bool used = false;
};

Eigen::Vector2d At(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double z) {
  const double s = std::clamp((z - a.z()) / (b.z() - a.z()), 0.0, 1.0);
  return (a + s * (b - a)).head<2>();
}

std::vector<Segment> SegmentsOf(const TriangleMesh& mesh, double low, double middle, double high) {
  std::vector<Segment> segments;
  for (const auto& t : mesh.triangles) {
    Segment segment;
    int found = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const int i = t[k];
      const int j = t[(k + 1) % 3];
      const Eigen::Vector3d& a = mesh.points[static_cast<std::size_t>(std::min(i, j))];
      const Eigen::Vector3d& b = mesh.points[static_cast<std::size_t>(std::max(i, j))];
      const bool up = mesh.points[static_cast<std::size_t>(i)].z() < middle &&
                      mesh.points[static_cast<std::size_t>(j)].z() > middle;
      const bool down = mesh.points[static_cast<std::size_t>(i)].z() > middle &&
                        mesh.points[static_cast<std::size_t>(j)].z() < middle;
      if (!up && !down) continue;
      const std::uint64_t key =
          static_cast<std::uint64_t>(std::min(i, j)) << 32 | static_cast<std::uint64_t>(std::max(i, j));
      // Seen from outside, walking with the material on the left leads from the falling edge to the rising one.
      (up ? segment.to : segment.from) = {key, {At(a, b, middle), At(a, b, low), At(a, b, high)}};
      ++found;
    }
    if (found == 2) segments.push_back(segment);
  }
  return segments;
}

/// The nearest start that is not used yet, within a gap.
std::size_t NearestStart(const std::vector<Segment>& segments, const Eigen::Vector2d& p, double gap_m) {
  std::size_t best = segments.size();
  double nearest = gap_m;
  for (std::size_t i = 0; i < segments.size(); ++i) {
    if (segments[i].used) continue;
    const double distance = (segments[i].from.point.middle - p).norm();
    if (distance <= nearest) {
      nearest = distance;
      best = i;
    }
  }
  return best;
}

std::vector<SlabLoop> Chain(std::vector<Segment> segments, double gap_m) {
  std::unordered_map<std::uint64_t, std::vector<std::size_t>> starts;
  for (std::size_t i = 0; i < segments.size(); ++i) starts[segments[i].from.edge].push_back(i);
  std::vector<SlabLoop> loops;
  for (std::size_t first = 0; first < segments.size(); ++first) {
    if (segments[first].used) continue;
    SlabLoop loop;
    std::size_t i = first;
    bool closed = false;
    while (true) {
      segments[i].used = true;
      loop.push_back(segments[i].from.point);
      const Crossing& end = segments[i].to;
      if (end.edge == segments[first].from.edge) {
        closed = true;
        break;
      }
      std::size_t next = segments.size();
      if (const auto found = starts.find(end.edge); found != starts.end()) {
        for (const std::size_t candidate : found->second) {
          if (!segments[candidate].used) {
            next = candidate;
            break;
          }
        }
      }
      if (next == segments.size()) {
        if ((end.point.middle - segments[first].from.point.middle).norm() <= gap_m && loop.size() > 2) {
          closed = true;
          break;
        }
        next = NearestStart(segments, end.point.middle, gap_m);
        if (next == segments.size()) break;
      }
      i = next;
    }
    if (closed && loop.size() >= 3 && std::abs(SignedArea(loop)) > 1e-14) loops.push_back(std::move(loop));
  }
  return loops;
}

double DistanceToSegment(const Eigen::Vector2d& p, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector2d along = b - a;
  const double length = along.squaredNorm();
  const double s = length > 0 ? std::clamp((p - a).dot(along) / length, 0.0, 1.0) : 0.0;
  return (p - a - s * along).norm();
}

double LargestDistance(const SlabPoint& p, const SlabPoint& a, const SlabPoint& b) {
  return std::max({DistanceToSegment(p.middle, a.middle, b.middle), DistanceToSegment(p.low, a.low, b.low),
                   DistanceToSegment(p.high, a.high, b.high)});
}

/// How far the convex hull of two edges of the part stands off the line between them in the middle of the slab: none
/// where they lie in a plane, as on a prism or on a cone between two of its straight lines.
double Twist(const SlabPoint& a, const SlabPoint& b) {
  return DistanceToSegment(0.5 * (a.low + b.high), a.middle, b.middle);
}

using ToleranceAt = std::function<double(const SlabPoint&)>;

/// Leaves out a corner when it and all that were left out beside it lie on the line between those that stay.
SlabLoop WithoutStraight(const SlabLoop& loop, const ToleranceAt& tolerance_at) {
  constexpr double kStraight = 0.1;  // of the tolerance
  const std::size_t count = loop.size();
  std::vector<bool> keep(count, true);
  std::size_t left = count;
  const auto neighbour = [&](std::size_t i, std::size_t step) {
    do {
      i = (i + step) % count;
    } while (!keep[i]);
    return i;
  };
  for (std::size_t i = 0; i < count && left > 3; ++i) {
    const std::size_t before = neighbour(i, count - 1);
    const std::size_t after = neighbour(i, 1);
    bool straight = Twist(loop[before], loop[after]) <= kStraight * tolerance_at(loop[i]);
    for (std::size_t k = (before + 1) % count; k != after && straight; k = (k + 1) % count) {
      straight = LargestDistance(loop[k], loop[before], loop[after]) <= kStraight * tolerance_at(loop[k]);
    }
    if (!straight) continue;
    keep[i] = false;
    --left;
  }
  SlabLoop kept;
  for (std::size_t i = 0; i < count; ++i) {
    if (keep[i]) kept.push_back(loop[i]);
  }
  return kept;
}

std::size_t Farthest(const SlabLoop& loop, std::size_t from) {
  std::size_t best = from;
  const auto distance = [&](std::size_t i) { return (loop[i].middle - loop[from].middle).squaredNorm(); };
  for (std::size_t i = 0; i < loop.size(); ++i) {
    if (distance(i) > distance(best) + 1e-18) best = i;
  }
  return best;
}

}  // namespace

SlabLoop Simplified(const SlabLoop& original, const ToleranceAt& tolerance_at) {
  if (original.size() < 4) return original;
  const SlabLoop loop = WithoutStraight(original, tolerance_at);
  const std::size_t count = loop.size();
  // From the corner that is farthest from the first, and that which is farthest from it: both stay in any case.
  const std::size_t a = Farthest(loop, 0);
  const std::size_t b = Farthest(loop, a);
  std::vector<bool> keep(count, false);
  keep[a] = keep[b] = true;
  std::vector<std::pair<std::size_t, std::size_t>> spans{{a, b < a ? b + count : b}, {b, a < b ? a + count : a}};
  while (!spans.empty()) {
    const auto [first, last] = spans.back();
    spans.pop_back();
    double worst = 0;
    std::size_t at = first;
    for (std::size_t i = first + 1; i < last; ++i) {
      const SlabPoint& p = loop[i % count];
      const double excess = LargestDistance(p, loop[first % count], loop[last % count]) / tolerance_at(p);
      if (excess > worst) {
        worst = excess;
        at = i;
      }
    }
    if (worst <= 1) {
      const SlabPoint& from = loop[first % count];
      const SlabPoint& to = loop[last % count];
      if (last - first < 2 || Twist(from, to) <= std::min(tolerance_at(from), tolerance_at(to))) continue;
      at = (first + last) / 2;
    }
    keep[at % count] = true;
    spans.emplace_back(first, at);
    spans.emplace_back(at, last);
  }
  SlabLoop kept;
  for (std::size_t i = 0; i < count; ++i) {
    if (keep[i]) kept.push_back(loop[i]);
  }
  return kept;
}

double SignedArea(const SlabLoop& loop) {
  double twice = 0;
  const Eigen::Vector2d origin = loop.front().middle;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const Eigen::Vector2d a = loop[i].middle - origin;
    const Eigen::Vector2d b = loop[(i + 1) % loop.size()].middle - origin;
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return twice / 2;
}

Eigen::AlignedBox2d BoundsOf(const SlabLoop& loop) {
  Eigen::AlignedBox2d box;
  for (const SlabPoint& p : loop) box.extend(p.middle);
  return box;
}

bool Encloses(const SlabLoop& loop, const Eigen::Vector2d& point) {
  bool inside = false;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const Eigen::Vector2d& a = loop[i].middle;
    const Eigen::Vector2d& b = loop[(i + 1) % loop.size()].middle;
    if ((a.y() > point.y()) == (b.y() > point.y())) continue;
    if (point.x() < a.x() + (point.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x())) inside = !inside;
  }
  return inside;
}

bool IsMaterial(const std::vector<SlabLoop>& loops, const Eigen::Vector2d& point) {
  int winding = 0;
  for (const SlabLoop& loop : loops) {
    if (Encloses(loop, point)) winding += SignedArea(loop) > 0 ? 1 : -1;
  }
  return winding > 0;
}

std::vector<double> LevelsOf(const TriangleMesh& mesh, double tolerance_m) {
  std::vector<double> heights;
  heights.reserve(mesh.points.size());
  for (const Eigen::Vector3d& p : mesh.points) heights.push_back(p.z());
  std::sort(heights.begin(), heights.end());
  std::vector<double> levels;
  for (std::size_t begin = 0; begin < heights.size();) {
    std::size_t end = begin;
    while (end < heights.size() && heights[end] - heights[begin] <= tolerance_m) ++end;
    levels.push_back(0.5 * (heights[begin] + heights[end - 1]));
    begin = end;
  }
  return levels;
}

Slab SlabBetween(const TriangleMesh& mesh, double low_m, double high_m, double gap_m) {
  return {low_m, high_m, Chain(SegmentsOf(mesh, low_m, 0.5 * (low_m + high_m), high_m), gap_m)};
}

std::vector<SlabLoop> SectionAt(const TriangleMesh& mesh, double height_m) {
  return Chain(SegmentsOf(mesh, height_m, height_m, height_m), 2e-5);
}

}  // namespace feeler::cad
