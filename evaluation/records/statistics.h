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

/// A statistic with a 95 % interval.
struct Estimate {
  double value = 0.0;
  double low = 0.0;
  double high = 0.0;
};
/// Median with a percentile bootstrap interval (Efron 1979; 1000 resamples from a fixed stream: the same values give
/// the same interval). All zero for no values.
Estimate BootstrapMedian(const std::vector<double>& values);
/// The same of the mean.
Estimate BootstrapMean(const std::vector<double>& values);
/// mean(numerators) / mean(denominators) of paired values; pairs are resampled. Throws InputError for different sizes.
Estimate BootstrapRatio(const std::vector<double>& numerators, const std::vector<double>& denominators);

/// Mean; 0 for no values.
double Mean(const std::vector<double>& values);
/// The q-quantile (0..1) by linear interpolation between order statistics; 0 for no values.
double Quantile(std::vector<double> values, double q);
inline double Median(std::vector<double> values) { return Quantile(std::move(values), 0.5); }

}  // namespace feeler::evaluation
