#include "feeler/perception/registration.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <optional>
#include <tuple>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/perception/clusters.h"
#include "feeler/perception/contradiction.h"
#include "feeler/perception/icp_fit.h"

namespace feeler::perception {
namespace {

constexpr double kFineSpacing_m = 0.005;
constexpr double kCoarseSpacing_m = 0.014;
constexpr double kLink_m = 0.02;  // cubes of points that touch belong together
constexpr int kLeastModelPoints = 50;
// Not looked for is what is turned farther from the nominal orientation. Targets of a workspace are turned by up to 15
// degrees, and a box looks like itself every 90.
constexpr double kMostTurn_rad = 0.44;
constexpr double kSureFitness = 0.8;   // below, the search is repeated with more starts and all points near a cluster
constexpr double kSureRms_m = 0.0015;  // above, likewise

SurfacePoints Checked(const SurfacePoints& surface) {
  const auto finite = [](const Eigen::Vector3d& v) { return v.allFinite(); };
  if (surface.points.size() < kLeastModelPoints || surface.points.size() != surface.normals.size() ||
      !std::all_of(surface.points.begin(), surface.points.end(), finite) ||
      !std::all_of(surface.normals.begin(), surface.normals.end(), finite)) {
    throw InputError("model of the target", fmt::format("{} points are no surface", surface.points.size()),
                     fmt::format("give at least {} finite points, each with its normal", kLeastModelPoints));
  }
  return surface;
}

TargetModel::Level MakeLevel(const SurfacePoints& surface, double spacing_m) {
  SurfacePoints thinned = Thinned(surface, spacing_m);
  NearestPoints tree(thinned.points);
  return {spacing_m, std::move(thinned), std::move(tree)};
}

Eigen::Vector3d Mean(const Points& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) sum += p;
  return sum / static_cast<double>(points.size());
}

/// A fit under way.
struct Candidate {
  Pose world_T_target;
  double score = 0.0;  ///< the better, the higher
};

double Turn(const Eigen::Matrix3d& from, const Eigen::Matrix3d& to) {
  return Eigen::AngleAxisd(from.transpose() * to).angle();
}

/// Where fits of a cluster start: turned either way, the middle of what is then seen of the model at the cluster's
/// middle, or, thorough, around it as well, for clusters of which a part is hidden.
std::vector<Pose> Starts(const IcpFit& fit, const TargetModel& model, const Eigen::Matrix3d& orientation,
                         bool thorough) {
  std::vector<Eigen::Vector3d> offsets = {Eigen::Vector3d::Zero()};
  std::vector<double> turns = {0.0};
  const double turn_rad = fit.options.start_turn_rad;
  if (!fit.options.rotation_axes.empty()) turns.insert(turns.end(), {turn_rad, -turn_rad});
  if (thorough) {
    constexpr double kAside = 0.5;  // of the model's radius
    for (const double sign : {-1.0, 1.0}) {
      for (int axis = 0; axis < 3; ++axis) {
        offsets.push_back(sign * kAside * model.radius_m() * Eigen::Vector3d::Unit(axis));
      }
    }
  }
  const Eigen::Vector3d centre = Mean(fit.scene);
  std::vector<Pose> starts;
  for (const double turn : turns) {
    Pose start = Pose::Identity();
    start.linear() = orientation;
    if (turn != 0.0) start.linear() = orientation * Eigen::AngleAxisd(turn, fit.options.rotation_axes.front());
    start.translation() = centre - start.linear() * model.center_m();
    Eigen::Vector3d seen = Eigen::Vector3d::Zero();
    const std::vector<std::size_t> visible = Visible(model.coarse(), start.inverse() * fit.eye_m);
    for (const std::size_t i : visible) seen += model.coarse().surface.points[i];
    if (visible.empty()) continue;
    start.translation() = centre - start.linear() * (seen / static_cast<double>(visible.size()));
    for (const Eigen::Vector3d& offset : offsets) {
      starts.push_back(start);
      starts.back().translation() += offset;
    }
  }
  return starts;
}

/// Those that score best and are not turned too far, one of those that have come to the same; at most `count`.
std::vector<Candidate> Best(std::vector<Candidate> candidates, const Eigen::Matrix3d& orientation, double most_turn_rad,
                            std::size_t count) {
  constexpr double kSame_m = 0.003;
  constexpr double kSame_rad = 0.02;
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.score > b.score; });
  std::vector<Candidate> best;
  for (const Candidate& candidate : candidates) {
    if (best.size() == count) break;
    const Pose& pose = candidate.world_T_target;
    if (Turn(orientation, pose.linear()) > most_turn_rad) continue;
    const bool known = std::any_of(best.begin(), best.end(), [&](const Candidate& other) {
      return (other.world_T_target.translation() - pose.translation()).norm() < kSame_m &&
             Turn(other.world_T_target.linear(), pose.linear()) < kSame_rad;
    });
    if (!known) best.push_back(candidate);
  }
  return best;
}

/// What stays the same for all clusters.
struct Search {
  const TargetModel& model;
  const Eigen::Matrix3d& orientation;
  const Eigen::Vector3d& eye_m;
  const RegistrationOptions& options;
  const SightGrid& sight;
};

/// The fit of one cluster. Fitness is zero where none is to be had.
Registration RegisterCluster(const Points& cluster, const Search& search, bool thorough) {
  const auto& [model, orientation, eye_m, options, sight] = search;
  constexpr double kRoughSpacing_m = 0.016;
  const Points rough_scene = Thinned(cluster, kRoughSpacing_m);
  const NearestPoints rough_tree(rough_scene);
  const IcpFit rough{rough_scene, rough_tree, model.coarse(), options, eye_m, kRoughSpacing_m};
  const auto refined = [&](Pose pose, double gate_m, double last_gate_m, int iterations) -> Candidate {
    Refine(rough, gate_m, last_gate_m, iterations, pose);
    const FitQuality quality = Judge(rough, pose);
    return {pose, quality.fitness + quality.explained - quality.rms_m / kMet_m};
  };
  // A few steps from everywhere tell which starts are worth the rest.
  std::vector<Candidate> candidates;
  for (const Pose& start : Starts(rough, model, orientation, thorough)) {
    candidates.push_back(refined(start, 0.08, 0.05, 5));
  }
  constexpr double kSlack = 1.5;  // what is turned too far half-way may still come back
  const std::size_t kept = thorough ? 4 : 2;
  std::vector<Candidate> settled;
  for (const Candidate& candidate : Best(std::move(candidates), orientation, kSlack * kMostTurn_rad, kept)) {
    settled.push_back(refined(candidate.world_T_target, 0.05, 0.04, 8));
  }
  settled = Best(std::move(settled), orientation, kMostTurn_rad, 1);
  Registration result;
  if (settled.empty()) return result;
  Pose pose = settled.front().world_T_target;

  const NearestPoints tree(cluster);
  const IcpFit fine{cluster, tree, model.fine(), options, eye_m, options.scene_spacing_m};
  Refine(fine, 0.035, 0.015, 12, pose);
  const FitQuality quality = Judge(fine, pose, &result.covariance);
  result.world_T_target = pose;
  result.fitness = quality.fitness;
  result.explained = quality.explained;
  result.rms_m = quality.rms_m;
  result.points = static_cast<int>(cluster.size());
  Contradict(fine, model, sight, pose, result);
  return result;
}

/// What nothing speaks against comes before what something does, and anything before nothing.
bool Better(const Registration& a, const Registration& b, const MatchLimits& limits, double score_a, double score_b) {
  if (a.points == 0 || b.points == 0) return a.points > 0;
  if (limits.Contradicted(a) != limits.Contradicted(b)) return !limits.Contradicted(a);
  return score_a > score_b;
}

std::string WhyNotFound(const Registration& fit, const MatchLimits& limits) {
  if (fit.points == 0) {
    return fmt::format("every fit is turned by more than {:.0f} degrees", kMostTurn_rad * 57.29577951308232);
  }
  if (fit.fitness < limits.least_fitness) {
    return fmt::format("the best fit meets {:.0f} % of what should be seen of the target, below {:.0f} %",
                       100.0 * fit.fitness, 100.0 * limits.least_fitness);
  }
  if (fit.beyond > limits.most_beyond) {
    return fmt::format(
        "what is seen is larger than the target: it goes on beyond {:.1f} % of its edges, above {:.1f} %",
        100.0 * fit.beyond, 100.0 * limits.most_beyond);
  }
  if (fit.seen_through > limits.most_seen_through) {
    return fmt::format("the camera sees through {:.1f} % of where the target would be, above {:.1f} %",
                       100.0 * fit.seen_through, 100.0 * limits.most_seen_through);
  }
  return fmt::format("{:.1f} cm2 of the target in one piece are missing, above {:.1f}: the camera sees through them",
                     1e4 * fit.missing_m2, 1e4 * limits.most_missing_m2);
}

}  // namespace

TargetModel::TargetModel(const SurfacePoints& surface)
    : fine_(MakeLevel(Checked(surface), kFineSpacing_m)), coarse_(MakeLevel(surface, kCoarseSpacing_m)) {
  Eigen::Vector3d lower = surface.points.front();
  Eigen::Vector3d upper = surface.points.front();
  for (const Eigen::Vector3d& p : surface.points) {
    lower = lower.cwiseMin(p);
    upper = upper.cwiseMax(p);
  }
  center_m_ = 0.5 * (lower + upper);
  radius_m_ = 0.5 * (upper - lower).norm();
}

void RegistrationOptions::Validate() const {
  const auto require = [](bool good, const char* what) {
    if (!good) throw InputError("registration options", what, "see perception/registration.h");
  };
  for (const Eigen::Vector3d& axis : rotation_axes) {
    require(std::abs(axis.norm() - 1.0) < 1e-6, "a rotation axis is not a unit vector");
  }
  require(rotation_axes.size() <= 3, "more than three rotation axes");
  require(edge_weight >= 0.0 && std::isfinite(start_turn_rad), "a weight or start is not a number");
  require(neighbourhood_m > 0.0 && scene_spacing_m > 0.0, "a length is not positive");
  require(clusters >= 1 && least_points >= 3, "no cluster or no points to fit");
}

Registration Register(const Points& scene, const TargetModel& model, const Eigen::Matrix3d& nominal_orientation,
                      const Eigen::Vector3d& eye_m, const RegistrationOptions& options, const Points& measured) {
  options.Validate();
  Points finite;
  finite.reserve(scene.size());
  constexpr double kFarthest_m = 100.0;
  for (const Eigen::Vector3d& p : scene) {
    if (p.allFinite() && p.cwiseAbs().maxCoeff() < kFarthest_m) finite.push_back(p);
  }
  Registration best;
  const Points thinned = Thinned(finite, options.scene_spacing_m);
  if (thinned.empty()) {
    best.reason = "no points are left once the background is taken away";
    return best;
  }
  const std::vector<Cluster> clusters = DensestClusters(thinned, kLink_m, options.neighbourhood_m,
                                                        2.0 * model.radius_m(), options.least_points, options.clusters);
  if (clusters.empty()) {
    best.reason = fmt::format("no group of {} points that belong together", options.least_points);
    return best;
  }
  const SightGrid sight(measured.empty() ? finite : measured, eye_m, clusters.front().densest_m,
                        options.scene_spacing_m);
  const MatchLimits& limits = options.limits;
  const Search search{model, nominal_orientation, eye_m, options, sight};
  for (const Cluster& cluster : clusters) {
    Registration fit = RegisterCluster(cluster.points, search, false);
    if (Better(fit, best, limits, fit.fitness, best.fitness)) best = std::move(fit);
  }
  if (best.fitness < kSureFitness || best.rms_m > kSureRms_m || limits.Contradicted(best)) {
    // Something may stand before the target and cut it in two: all that is near belongs to it, and fits start aside
    // too.
    Points middles;
    for (const Cluster& cluster : clusters) {
      const auto near = [&](double distance_m) {
        return [&cluster, distance_m](const Eigen::Vector3d& p) { return (p - cluster.densest_m).norm() < distance_m; };
      };
      if (std::any_of(middles.begin(), middles.end(), near(model.radius_m()))) continue;  // a part of the same
      middles.push_back(cluster.densest_m);
      Points company;
      std::copy_if(thinned.begin(), thinned.end(), std::back_inserter(company), near(2.0 * model.radius_m()));
      Registration fit = RegisterCluster(company, search, true);
      const auto score = [](const Registration& r) { return r.fitness - r.rms_m / kMet_m; };
      if (Better(fit, best, limits, score(fit), score(best))) best = std::move(fit);
    }
  }
  best.found = limits.Allow(best);
  if (!best.found) best.reason = WhyNotFound(best, limits);
  return best;
}

}  // namespace feeler::perception
