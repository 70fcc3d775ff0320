#include "evaluation/statistics.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/error.h"

namespace feeler::evaluation {

Rate WilsonRate(int successes, int trials) {
  if (successes < 0 || successes > trials) throw InputError("rate", "successes must lie in 0..trials");
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
