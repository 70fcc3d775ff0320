#pragma once

#include <vector>

namespace feeler::evaluation {

/// A rate with its Wilson score interval (Wilson 1927) at 95 % confidence.
struct Rate {
  int successes = 0;
  int trials = 0;
  double value = 0.0;
  double low = 0.0;
  double high = 1.0;
};
/// Throws InputError unless 0 <= successes <= trials.
Rate WilsonRate(int successes, int trials);

/// Mean; 0 for no values.
double Mean(const std::vector<double>& values);
/// The q-quantile (0..1) by linear interpolation between order statistics; 0 for no values.
double Quantile(std::vector<double> values, double q);
inline double Median(std::vector<double> values) { return Quantile(std::move(values), 0.5); }

}  // namespace feeler::evaluation
