#include "feeler/cad/align/features.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

namespace feeler::cad {
namespace {

constexpr std::size_t kMostSlabs = 24;
constexpr std::size_t kMostLevels = 200;

void Dominant(Feature& feature) {
  constexpr int kBins = 360;
  std::array<double, kBins> length{};
  double perimeter = 0;
  const auto bin_of = [](double angle) {
    return static_cast<int>(std::floor(angle / std::numbers::pi * kBins)) % kBins;
  };
  const auto angle_of = [](const Eigen::Vector2d& e) {
    const double angle = std::atan2(e.y(), e.x());
    const double folded = angle < 0 ? angle + std::numbers::pi : angle;
    return folded >= std::numbers::pi - 1e-9 ? 0.0 : folded;
  };
  const std::size_t count = feature.loop.size();
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector2d e = feature.loop[(i + 1) % count].middle - feature.loop[i].middle;
    length[static_cast<std::size_t>(bin_of(angle_of(e) + 1e-9))] += e.norm();
    perimeter += e.norm();
  }
  const auto best = std::max_element(length.begin(), length.end());
  feature.has_edges = *best > 0.08 * perimeter;
  // The exact direction: that of the longest edge in the bin.
  double longest = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector2d e = feature.loop[(i + 1) % count].middle - feature.loop[i].middle;
    if (bin_of(angle_of(e) + 1e-9) != best - length.begin() || e.norm() <= longest + 1e-9) continue;
    longest = e.norm();
    feature.edge_rad = angle_of(e);
  }
}

/// The slabs that are looked at: all of them, or, of a free form with very many levels, the thickest.
std::vector<std::size_t> SlabsToLookAt(const std::vector<double>& levels) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i + 1 < levels.size(); ++i) order.push_back(i);
  if (order.size() <= kMostLevels) return order;
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return levels[a + 1] - levels[a] > levels[b + 1] - levels[b] + 1e-9;
  });
  order.resize(kMostSlabs);
  std::sort(order.begin(), order.end());
  return order;
}

SlabLoop LowerEnd(SlabLoop loop) {
  for (SlabPoint& p : loop) p.middle = p.low;
  return loop;
}

SlabLoop UpperEnd(SlabLoop loop) {
  for (SlabPoint& p : loop) p.middle = p.high;
  return loop;
}

/// 1 if the area grows from the lower end to the upper, -1 if it shrinks.
int Tapers(const SlabLoop& low, const SlabLoop& high) {
  const double low_m2 = std::abs(SignedArea(LowerEnd(low)));
  const double high_m2 = std::abs(SignedArea(UpperEnd(high)));
  if (std::abs(high_m2 - low_m2) <= 1e-4 * std::max(low_m2, high_m2)) return 0;
  return high_m2 > low_m2 ? 1 : -1;
}

double Around(const SlabLoop& loop) {
  double length = 0.0;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    length += (loop[i].middle - loop[(i + 1) % loop.size()].middle).norm();
  }
  return length;
}

/// A line that goes on into the next slab, as of a prism or a taper. Where the slabs meet it is the same; what steps
/// there, as at the end of a key, is another, however little that is of the whole.
bool GoesOn(const Feature& below, const Feature& above) {
  constexpr double kSame_m = 4e-6;  // lines are simplified by 1e-6
  if (below.hole != above.hole || std::abs(below.high_m - above.low_m) > 1e-9) return false;
  if (std::abs(below.area - above.area) > 0.03 * std::max(below.area, above.area)) return false;
  if (Tapers(below.loop, below.loop) != Tapers(above.loop, above.loop)) return false;
  const SlabLoop end = UpperEnd(below.loop);
  const SlabLoop begin = LowerEnd(above.loop);
  if (std::abs(std::abs(SignedArea(end)) - std::abs(SignedArea(begin))) > kSame_m * Around(end)) return false;
  const Eigen::AlignedBox2d a = BoundsOf(below.loop);
  const Eigen::AlignedBox2d b = BoundsOf(above.loop);
  return (a.center() - b.center()).norm() < 0.02 * a.sizes().maxCoeff();
}

}  // namespace

std::vector<Feature> FeaturesOf(const TriangleMesh& mesh) {
  const std::vector<double> levels = LevelsOf(mesh, 2e-6);
  // Chains of lines that go on from slab to slab; each is one feature, with the line in its middle.
  std::vector<std::vector<Feature>> chains;
  for (const std::size_t i : SlabsToLookAt(levels)) {
    for (const SlabLoop& raw : SlabBetween(mesh, levels[i], levels[i + 1]).loops) {
      Feature feature;
      feature.loop = Simplified(raw, [](const SlabPoint&) { return 1e-6; });
      const double area = SignedArea(feature.loop);
      feature.hole = area < 0;
      feature.area = std::abs(area);
      feature.low_m = levels[i];
      feature.high_m = levels[i + 1];
      if (feature.area < 1e-8) continue;  // a tenth of a millimetre across
      const auto chain =
          std::find_if(chains.begin(), chains.end(), [&](const auto& known) { return GoesOn(known.back(), feature); });
      if (chain == chains.end()) {
        chains.push_back({std::move(feature)});
      } else {
        chain->push_back(std::move(feature));
      }
    }
  }
  std::vector<Feature> features;
  for (const std::vector<Feature>& chain : chains) {
    const double middle = 0.5 * (chain.front().low_m + chain.back().high_m);
    const auto at =
        std::find_if(chain.begin(), chain.end(), [&](const Feature& f) { return f.high_m >= middle - 1e-12; });
    Feature feature = *at;
    feature.low_m = chain.front().low_m;
    feature.high_m = chain.back().high_m;
    feature.tapers = Tapers(chain.front().loop, chain.back().loop);
    const Eigen::Vector2d low = BoundsOf(LowerEnd(chain.front().loop)).center();
    const Eigen::Vector2d high = BoundsOf(UpperEnd(chain.back().loop)).center();
    feature.lean = (high - low).norm() / (feature.high_m - feature.low_m);
    if (feature.tapers != 0) {
      feature.low_loop = LowerEnd(chain.front().loop);
      feature.high_loop = UpperEnd(chain.back().loop);
    }
    Dominant(feature);
    feature.profile = ProfileOf(feature.loop);
    features.push_back(std::move(feature));
  }
  return features;
}

}  // namespace feeler::cad
