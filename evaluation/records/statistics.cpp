#include "feeler/evaluation/records/statistics.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include "feeler/core/error.h"
#include "feeler/core/random.h"

namespace feeler::evaluation {

Rate WilsonRate(int successes, int trials) {
  if (successes < 0 || successes > trials) throw InputError("rate", "successes must lie in 0..trials", "count again");
  Rate rate{successes, trials, 0.0, 0.0, 1.0};
  if (trials == 0) return rate;
  constexpr double kZ = 1.959963984540054;  // 97.5 % quantile of the standard normal
  const double n = trials;
  const double p = successes / n;
  const double denominator = 1 + kZ * kZ / n;
  const double centre = (p + kZ * kZ / (2 * n)) / denominator;
  const double half = kZ / denominator * std::sqrt(p * (1 - p) / n + kZ * kZ / (4 * n * n));
  rate.value = p;
  rate.low = successes == 0 ? 0.0 : std::max(0.0, centre - half);
  rate.high = successes == trials ? 1.0 : std::min(1.0, centre + half);
  return rate;
}

namespace {

/// `statistic` of indices into the sample; its 95 % percentile interval over resamples.
Estimate Bootstrap(std::size_t count, const std::function<double(const std::vector<std::size_t>&)>& statistic) {
  constexpr int kResamples = 1000;
  Estimate estimate;
  if (count == 0) return estimate;
  std::vector<std::size_t> indices(count);
  std::iota(indices.begin(), indices.end(), std::size_t{0});
  estimate.value = statistic(indices);
  RandomStream random(1, count, "bootstrap");
  std::vector<double> resampled;
  for (int i = 0; i < kResamples; ++i) {
    for (std::size_t& index : indices) index = random.Index(count);
    resampled.push_back(statistic(indices));
  }
  estimate.low = Quantile(resampled, 0.025);
  estimate.high = Quantile(resampled, 0.975);
  return estimate;
}

double SumAt(const std::vector<double>& values, const std::vector<std::size_t>& indices) {
  double sum = 0.0;
  for (const std::size_t index : indices) sum += values[index];
  return sum;
}

}  // namespace

Estimate BootstrapMedian(const std::vector<double>& values) {
  return Bootstrap(values.size(), [&](const std::vector<std::size_t>& indices) {
    std::vector<double> drawn;
    drawn.reserve(indices.size());
    for (const std::size_t index : indices) drawn.push_back(values[index]);
    return Median(std::move(drawn));
  });
}

Estimate BootstrapMean(const std::vector<double>& values) {
  return Bootstrap(values.size(), [&](const std::vector<std::size_t>& indices) {
    return SumAt(values, indices) / static_cast<double>(indices.size());
  });
}

Estimate BootstrapRatio(const std::vector<double>& numerators, const std::vector<double>& denominators) {
  if (numerators.size() != denominators.size())
    throw InputError("ratio", "the values are not paired", "give two lists of one length");
  return Bootstrap(numerators.size(), [&](const std::vector<std::size_t>& indices) {
    const double below = SumAt(denominators, indices);
    return below > 0.0 ? SumAt(numerators, indices) / below : 0.0;
  });
}

double Mean(const std::vector<double>& values) {
  if (values.empty()) return 0.0;
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double Quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  const double position = std::clamp(q, 0.0, 1.0) * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(position);
  const std::size_t above = std::min(below + 1, values.size() - 1);
  const double fraction = position - static_cast<double>(below);
  return values[below] + fraction * (values[above] - values[below]);
}

}  // namespace feeler::evaluation
