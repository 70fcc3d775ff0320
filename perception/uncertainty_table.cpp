#include "feeler/perception/uncertainty_table.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "feeler/core/error.h"

namespace feeler::perception {
namespace {

/// Estimates nearer than this to an axis' own noise still get a scale.
constexpr double kLeastScale = 0.1;  // of the resolution

double Distance(const UncertaintyTable& table, const Pose& pose) {
  return (pose.translation() - table.camera_m).norm();
}

Pose WithoutBias(const UncertaintyTable& table, const UncertaintyRule& rule, const Pose& world_T_estimate) {
  Pose pose = world_T_estimate;
  pose.translation() -= ViewAxes(table.camera_m, world_T_estimate.translation()) * rule.bias_m;
  return pose;
}

/// The value below which a share of the values lies; `values` is reordered.
double Quantile(std::vector<double>& values, double share) {
  const double place = share * static_cast<double>(values.size());
  const auto index =
      static_cast<std::size_t>(std::clamp(std::ceil(place) - 1.0, 0.0, static_cast<double>(values.size() - 1)));
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(index), values.end());
  return values[index];
}

/// Means over the samples of each installation, in order of their numbers.
template <class Value>
std::map<int, Value> MeanByInstallation(const std::vector<const PoseSample*>& samples,
                                        const std::vector<Value>& values) {
  std::map<int, std::pair<Value, double>> sums;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const auto [entry, added] = sums.try_emplace(samples[i]->installation, values[i], 1.0);
    if (added) continue;
    entry->second.first += values[i];
    entry->second.second += 1.0;
  }
  std::map<int, Value> means;
  for (const auto& [installation, sum] : sums) means.emplace(installation, sum.first / sum.second);
  return means;
}

/// Every installation counts the same, however many of its samples there are.
Eigen::Vector3d MeanBias(const UncertaintyTable& table, const std::vector<const PoseSample*>& samples) {
  std::vector<Eigen::Vector3d> errors;
  for (const PoseSample* sample : samples) {
    const Eigen::Vector3d& estimate = sample->world_T_estimate.translation();
    errors.emplace_back(ViewAxes(table.camera_m, estimate).transpose() *
                        (estimate - sample->world_T_true.translation()));
  }
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  const auto means = MeanByInstallation(samples, errors);
  for (const auto& [installation, mean] : means) sum += mean;
  return sum / static_cast<double>(means.size());
}

/// Half extents: what the errors of one installation need, jointly over the axes, and what installations differ by.
Eigen::VectorXd JointHalf(const UncertaintyTable& table, const UncertaintyRule& rule,
                          const std::vector<const PoseSample*>& samples, const TableOptions& options) {
  std::vector<Eigen::VectorXd> offsets;
  for (const PoseSample* sample : samples) {
    offsets.push_back(
        OffsetAlong(table.axes, WithoutBias(table, rule, sample->world_T_estimate), sample->world_T_true));
  }
  const auto count = static_cast<Eigen::Index>(table.axes.size());
  const std::map<int, Eigen::VectorXd> means = MeanByInstallation(samples, offsets);
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(count);
  for (const auto& [installation, own] : means) mean += own / static_cast<double>(means.size());
  Eigen::VectorXd between = Eigen::VectorXd::Zero(count);
  for (const auto& [installation, own] : means) between += (own - mean).cwiseAbs2();
  if (means.size() > 1) between = (between / static_cast<double>(means.size() - 1)).cwiseSqrt();
  between = mean.cwiseAbs() + options.installation_deviations * between;

  std::vector<Eigen::VectorXd> within;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    within.emplace_back((offsets[i] - means.at(samples[i]->installation)).cwiseAbs());
  }
  Eigen::VectorXd scale(count);
  for (Eigen::Index axis = 0; axis < count; ++axis) {
    std::vector<double> sizes;
    for (const Eigen::VectorXd& size : within) sizes.push_back(size[axis]);
    constexpr double kTypical = 0.95;
    scale[axis] =
        std::max(Quantile(sizes, kTypical), kLeastScale * table.axes[static_cast<std::size_t>(axis)].resolution);
  }
  // The axes keep the proportions of their own 95 % quantiles; a common factor makes it joint.
  std::vector<double> factors;
  for (const Eigen::VectorXd& size : within) factors.push_back(size.cwiseQuotient(scale).maxCoeff());
  return between + scale * Quantile(factors, options.quantile) * options.margin;
}

/// What estimates are off on a mounting that is not known: as mountings count, not samples.
Eigen::VectorXd Deviation(const UncertaintyTable& table, const UncertaintyRule& rule,
                          const std::vector<const PoseSample*>& samples) {
  std::vector<Eigen::VectorXd> squares;
  for (const PoseSample* sample : samples) {
    squares.emplace_back(
        OffsetAlong(table.axes, WithoutBias(table, rule, sample->world_T_estimate), sample->world_T_true).cwiseAbs2());
  }
  const std::map<int, Eigen::VectorXd> means = MeanByInstallation(samples, squares);
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(table.axes.size()));
  for (const auto& [installation, mean] : means) sum += mean / static_cast<double>(means.size());
  for (Eigen::Index axis = 0; axis < sum.size(); ++axis) {
    const double least = kLeastScale * table.axes[static_cast<std::size_t>(axis)].resolution;
    sum[axis] = std::max(std::sqrt(sum[axis]), least);
  }
  return sum;
}

}  // namespace

Eigen::Matrix3d ViewAxes(const Eigen::Vector3d& eye_m, const Eigen::Vector3d& target_m) {
  Eigen::Matrix3d axes;
  const Eigen::Vector3d ray = target_m - eye_m;
  const Eigen::Vector3d along = ray.norm() > 0.0 ? ray.normalized() : Eigen::Vector3d::UnitX();
  Eigen::Vector3d across = along.cross(Eigen::Vector3d::UnitZ());
  across = across.norm() > 1e-6 ? across.normalized() : Eigen::Vector3d::UnitY();
  axes.col(0) = along;
  axes.col(1) = across;
  axes.col(2) = across.cross(along);
  return axes;
}

std::size_t RuleFor(const std::vector<UncertaintyRule>& rules, double distance_m) {
  for (std::size_t i = 0; i < rules.size(); ++i) {
    if (distance_m < rules[i].farthest_m) return i;
  }
  return rules.size() - 1;
}

std::vector<int> CountsFor(const std::vector<UncertainAxis>& axes, const Eigen::VectorXd& half, bool* clamped) {
  std::vector<int> counts;
  if (clamped != nullptr) *clamped = false;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    // Positions: n hypotheses reach n/2 cells either way; angles: (n - 1)/2, because a truth between two of
    // their lattice angles has one on each side.
    const double cells = 2.0 * half[static_cast<Eigen::Index>(i)] / axes[i].resolution;
    const int wanted = static_cast<int>(std::ceil(std::min(cells, 1e6) - 1e-9)) + (axes[i].angular() ? 1 : 0);
    const int count = std::clamp(wanted, axes[i].min_cells, axes[i].max_cells);
    if (clamped != nullptr && count < wanted) *clamped = true;
    counts.push_back(count);
  }
  return counts;
}

PoseHypotheses HypothesesFor(const UncertaintyTable& table, const std::vector<UncertaintyRule>& rules,
                             const Pose& world_T_estimate) {
  PoseHypotheses hypotheses;
  const std::size_t index = RuleFor(rules, Distance(table, world_T_estimate));
  const UncertaintyRule& rule = rules[index];
  hypotheses.rule = static_cast<int>(index);
  hypotheses.world_T_estimate = WithoutBias(table, rule, world_T_estimate);
  hypotheses.counts = CountsFor(table.axes, rule.half, &hypotheses.clamped);
  return hypotheses;
}

PoseHypotheses HypothesesFor(const UncertaintyTable& table, const Pose& world_T_estimate) {
  return HypothesesFor(table, table.rules, world_T_estimate);
}

Eigen::VectorXd OffsetAlong(const std::vector<UncertainAxis>& axes, const Pose& world_T_estimate,
                            const Pose& world_T_true) {
  const Pose difference = world_T_estimate.inverse() * world_T_true;
  const Eigen::AngleAxisd turn(difference.linear());
  const Eigen::Vector3d rotation = turn.angle() * turn.axis();
  Eigen::VectorXd offset(static_cast<Eigen::Index>(axes.size()));
  for (std::size_t i = 0; i < axes.size(); ++i) {
    switch (axes[i].kind) {
      case AxisKind::kYaw: offset[static_cast<Eigen::Index>(i)] = rotation.z(); break;
      case AxisKind::kPitch: offset[static_cast<Eigen::Index>(i)] = rotation.y(); break;
      default: offset[static_cast<Eigen::Index>(i)] = difference.translation()[static_cast<int>(axes[i].kind)];
    }
  }
  return offset;
}

bool Covers(const std::vector<UncertainAxis>& axes, const PoseHypotheses& hypotheses, const Pose& world_T_true) {
  const Eigen::VectorXd offset = OffsetAlong(axes, hypotheses.world_T_estimate, world_T_true);
  for (std::size_t i = 0; i < axes.size(); ++i) {
    if (std::abs(offset[static_cast<Eigen::Index>(i)]) > 0.5 * hypotheses.counts[i] * axes[i].resolution) return false;
  }
  return true;
}

std::vector<double> PriorDeviation(const UncertaintyTable& table) {
  const auto count = static_cast<Eigen::Index>(table.axes.size());
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(count);
  double samples = 0.0;
  for (const UncertaintyRule& rule : table.rules) {
    if (rule.deviation.size() != count) return {};
    const double weight = std::max(1, rule.samples);
    sum += weight * rule.deviation.cwiseAbs2();
    samples += weight;
  }
  const Eigen::VectorXd deviation = (sum / samples).cwiseSqrt();
  return {deviation.data(), deviation.data() + count};
}

void FitRules(const std::vector<PoseSample>& samples, const TableOptions& options, UncertaintyTable& table) {
  if (options.ranges < 1 || !(options.quantile > 0.0 && options.quantile <= 1.0) || !(options.margin >= 1.0)) {
    throw InputError("uncertainty table", "an option is out of range", "ranges >= 1, 0 < quantile <= 1, margin >= 1");
  }
  if (samples.size() < kLeastSamples) {
    throw InputError("uncertainty table", fmt::format("{} samples", samples.size()),
                     fmt::format("give at least {}", kLeastSamples));
  }
  const auto ranges = std::min(static_cast<std::size_t>(options.ranges), samples.size() / kLeastSamples);
  std::vector<const PoseSample*> order;
  for (const PoseSample& sample : samples) order.push_back(&sample);
  const auto distance = [&](const PoseSample* sample) { return Distance(table, sample->world_T_estimate); };
  std::stable_sort(order.begin(), order.end(),
                   [&](const PoseSample* a, const PoseSample* b) { return distance(a) < distance(b); });
  table.rules.clear();
  table.plain_rules.clear();
  for (std::size_t range = 0; range < ranges; ++range) {
    const std::size_t first = range * order.size() / ranges;
    const std::size_t last = (range + 1) * order.size() / ranges;
    const std::vector<const PoseSample*> own(order.begin() + static_cast<std::ptrdiff_t>(first),
                                             order.begin() + static_cast<std::ptrdiff_t>(last));
    UncertaintyRule plain;
    plain.nearest_m = range == 0 ? distance(own.front()) : table.rules.back().farthest_m;
    plain.farthest_m =
        last < order.size() ? 0.5 * (distance(order[last - 1]) + distance(order[last])) : distance(own.back()) + 1e-9;
    plain.samples = static_cast<int>(own.size());
    UncertaintyRule rule = plain;
    rule.bias_m = MeanBias(table, own);
    rule.half = JointHalf(table, rule, own, options);
    plain.half = JointHalf(table, plain, own, options);
    rule.deviation = Deviation(table, rule, own);
    plain.deviation = Deviation(table, plain, own);
    table.rules.push_back(rule);
    table.plain_rules.push_back(plain);
  }
}

TableScore ScoreTable(const UncertaintyTable& table, const std::vector<UncertaintyRule>& rules,
                      const std::vector<PoseSample>& samples) {
  TableScore score;
  score.largest_counts.assign(table.axes.size(), 0);
  double sum = 0.0;
  for (const PoseSample& sample : samples) {
    const PoseHypotheses hypotheses = HypothesesFor(table, rules, sample.world_T_estimate);
    int product = 1;
    for (std::size_t i = 0; i < hypotheses.counts.size(); ++i) {
      product *= hypotheses.counts[i];
      score.largest_counts[i] = std::max(score.largest_counts[i], hypotheses.counts[i]);
    }
    ++score.samples;
    score.covered += Covers(table.axes, hypotheses, sample.world_T_true) ? 1 : 0;
    score.clamped += hypotheses.clamped ? 1 : 0;
    sum += product;
    score.most_hypotheses = std::max(score.most_hypotheses, product);
  }
  if (score.samples > 0) score.mean_hypotheses = sum / score.samples;
  return score;
}

std::vector<std::vector<int>> FamilyOf(const UncertaintyTable& table) {
  std::set<std::vector<int>> cuboids;
  for (const UncertaintyRule& rule : table.rules) cuboids.insert(CountsFor(table.axes, rule.half));
  return {cuboids.begin(), cuboids.end()};
}

void RequireTask(const UncertaintyTable& table, const Task& task, const std::string& fingerprint,
                 const std::string& where) {
  if (table.fingerprint == fingerprint) return;
  throw InputError(
      where, fmt::format("is a table of the task '{}' with other geometry or lattice than '{}'", table.task, task.name),
      "make one with feeler perceive calibrate");
}

}  // namespace feeler::perception
