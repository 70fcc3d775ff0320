#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "feeler/core/pose.h"
#include "feeler/core/task.h"
#include "feeler/perception/match_evidence.h"

namespace feeler::perception {

/// An estimate beside the truth: what tables are made of and judged by.
struct PoseSample {
  Pose world_T_estimate = Pose::Identity();  ///< as registration gave it
  Pose world_T_true = Pose::Identity();
  int installation = 0;  ///< of the camera: errors of one mounting go together
};

/// How wrong estimates are at some distances from the camera.
struct UncertaintyRule {
  double nearest_m = 0.0;   ///< distance of the estimate from the camera: at least
  double farthest_m = 0.0;  ///< and less than
  /// Mean of (estimate - truth): along the view, across it to the right, and upwards square to both (ViewAxes).
  Eigen::Vector3d bias_m = Eigen::Vector3d::Zero();
  /// Half extents along each uncertain axis of the task, in its order, about the estimate without bias: m or rad.
  Eigen::VectorXd half;
  /// Standard deviation of the truth along each of those axes, about the middle of the half extents: within
  /// installations and between them. Empty in tables of old.
  Eigen::VectorXd deviation;
  int samples = 0;
};

/// The rules by which an estimate becomes a cuboid of hypotheses (the paper's rule-based uncertainty model, Sec. V-A):
/// one for each range of distance, in order, without gaps.
struct UncertaintyTable {
  static constexpr int kVersion = 1;

  std::string task;
  std::string fingerprint;  ///< of the task (env/model/fingerprint.h)
  std::vector<UncertainAxis> axes;
  Eigen::Vector3d camera_m = Eigen::Vector3d::Zero();  ///< where the camera stands, world
  int averaged_frames = 1;
  MatchLimits limits;  ///< which matches are believed; the defaults in tables that have none
  std::vector<UncertaintyRule> rules;
  /// The same without taking the bias out, as in the paper: half extents about the estimate itself.
  std::vector<UncertaintyRule> plain_rules;
};

/// Axes of a view from `eye` to `target`: columns along the view, across it (horizontal, to the right), upwards.
Eigen::Matrix3d ViewAxes(const Eigen::Vector3d& eye_m, const Eigen::Vector3d& target_m);

/// What an estimate means: where the middle of the cuboid lies, and how many hypotheses it has.
struct PoseHypotheses {
  Pose world_T_estimate = Pose::Identity();  ///< without bias: the centre of the cuboid, and its axes
  std::vector<int> counts;                   ///< along each uncertain axis of the task
  int rule = 0;
  bool clamped = false;  ///< the task allows fewer along some axis than the rule asks for
};

/// The rule for a distance; distances beyond the table take its first or last rule.
std::size_t RuleFor(const std::vector<UncertaintyRule>& rules, double distance_m);

/// Counts along the axes that cover these half extents: each hypothesis stands for half a cell (position), or a whole
/// lattice span (angle), either side; within the limits of the axes.
std::vector<int> CountsFor(const std::vector<UncertainAxis>& axes, const Eigen::VectorXd& half,
                           bool* clamped = nullptr);

/// The cuboid of an estimate by the table.
PoseHypotheses HypothesesFor(const UncertaintyTable& table, const Pose& world_T_estimate);
/// The same by `rules` in place of the table's own (the plain ones).
PoseHypotheses HypothesesFor(const UncertaintyTable& table, const std::vector<UncertaintyRule>& rules,
                             const Pose& world_T_estimate);

/// Where the truth lies from the middle of the cuboid, along each uncertain axis (m or rad; yaw about z and pitch about
/// y of the estimate).
Eigen::VectorXd OffsetAlong(const std::vector<UncertainAxis>& axes, const Pose& world_T_estimate,
                            const Pose& world_T_true);

/// Whether the truth lies in the cuboid: on every axis at once within half a cell of its outermost hypotheses.
bool Covers(const std::vector<UncertainAxis>& axes, const PoseHypotheses& hypotheses, const Pose& world_T_true);

struct TableOptions {
  int ranges = 4;  ///< of distance, each with the same number of samples; fewer where that is below kLeastSamples
  /// The half extents of a rule are the sum of two: what holds this share of its samples on all axes at once about the
  /// mean of their installation, times `margin`;
  double quantile = 0.995;
  double margin = 1.1;
  /// and so many standard deviations of the means of installations, axis by axis. A mounting errs within limits: for an
  /// error uniform between limits 1.7 deviations are its end. Few installations know the deviation badly, hence more.
  double installation_deviations = 3.0;
};

/// Fewest samples of a rule.
constexpr std::size_t kLeastSamples = 20;

/// The prior that the table makes: standard deviation along each uncertain axis over all its rules, by their samples.
/// Empty if a rule does not know its own.
std::vector<double> PriorDeviation(const UncertaintyTable& table);

/// Fits the rules to samples; `table` brings task, axes and camera. Throws InputError for fewer than kLeastSamples.
void FitRules(const std::vector<PoseSample>& samples, const TableOptions& options, UncertaintyTable& table);

/// How a table fares on samples that it was not made from.
struct TableScore {
  int samples = 0;
  int covered = 0;  ///< on all axes at once
  double mean_hypotheses = 0.0;
  int most_hypotheses = 0;
  std::vector<int> largest_counts;  ///< per axis
  int clamped = 0;
};
TableScore ScoreTable(const UncertaintyTable& table, const std::vector<UncertaintyRule>& rules,
                      const std::vector<PoseSample>& samples);

/// Every cuboid that the table can produce, each once, in order.
std::vector<std::vector<int>> FamilyOf(const UncertaintyTable& table);

/// The table as JSON (docs/file-formats.md) and back. ParseTable throws InputError, naming `where`, for another version
/// and for what is malformed or contradicts itself.
std::string ToJson(const UncertaintyTable& table, const std::string& report_json = "");
UncertaintyTable ParseTable(std::string_view json, const std::string& where);

/// Throws InputError unless the table was made for this task.
void RequireTask(const UncertaintyTable& table, const Task& task, const std::string& fingerprint,
                 const std::string& where);

}  // namespace feeler::perception
