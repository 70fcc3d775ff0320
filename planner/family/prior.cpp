#include "feeler/planner/family/prior.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "feeler/core/error.h"

namespace feeler::planner {
namespace {

/// Probability of each of n places along an axis, `resolution` apart about the middle.
std::vector<double> PriorAlong(int n, double resolution, double deviation) {
  constexpr double kEven = 0.05;
  const auto below = [&](double x) { return 0.5 * std::erfc(-x / (deviation * std::numbers::sqrt2)); };
  std::vector<double> mass;
  double total = 0.0;
  for (int i = 0; i < n; ++i) {
    const double place = (i - 0.5 * (n - 1)) * resolution;
    mass.push_back(below(place + 0.5 * resolution) - below(place - 0.5 * resolution));
    total += mass.back();
  }
  for (double& m : mass) m = (1.0 - kEven) * (total > 0.0 ? m / total : 1.0 / n) + kEven / n;
  return mass;
}

}  // namespace

void WeighByPrior(const Task& task, const std::vector<double>& deviation, const Extents& extents, Problem& problem) {
  if (deviation.empty()) return;
  if (deviation.size() != task.axes.size()) {
    throw InputError(problem.name, "the prior has not one deviation for each uncertain axis", "give one for each");
  }
  std::array<std::vector<double>, kAxisKinds> along;
  along.fill({1.0});
  for (std::size_t i = 0; i < task.axes.size(); ++i) {
    const UncertainAxis& axis = task.axes[i];
    if (!(deviation[i] > 0.0 && std::isfinite(deviation[i]))) {
      throw InputError(problem.name, fmt::format("a deviation of the prior is {}", deviation[i]),
                       "give a positive one");
    }
    along[static_cast<std::size_t>(axis.kind)] = PriorAlong(extents[axis.kind], axis.resolution, deviation[i]);
  }
  std::size_t next = 0;
  for (const double x : along[0]) {
    for (const double y : along[1]) {
      for (const double z : along[2]) {
        for (const double yaw : along[3]) {
          for (const double pitch : along[4]) problem.hypotheses[next++].weight = x * y * z * yaw * pitch;
        }
      }
    }
  }
}

}  // namespace feeler::planner
