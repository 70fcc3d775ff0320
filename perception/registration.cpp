#include "perception/registration.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <tuple>
#include <utility>

#include "core/error.h"
#include "perception/clusters.h"

namespace feeler::perception {
namespace {

constexpr double kFineSpacing_m = 0.005;
constexpr double kCoarseSpacing_m = 0.014;
constexpr double kLink_m = 0.02;  // cubes of points that touch belong together
constexpr double kNear_m = 0.012;
constexpr int kLeastModelPoints = 50;
constexpr double kSureFitness = 0.92;  // below, the search is repeated with more starts and all points near a cluster
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

/// One level of a fit: what is matched, and how.
struct Fit {
  const Points& scene;
  const NearestPoints& scene_tree;
  const TargetModel::Level& model;
  const RegistrationOptions& options;
  const Eigen::Vector3d& eye_m;
  double scene_spacing_m;
};

/// The part of the model that the eye sees. Only that may be matched: the back of a plate is as near as its front.
struct View {
  SurfacePoints surface;
  NearestPoints tree;
};

/// Indices of the model's points that face the eye and are not behind others of them: of the points that fall
/// into one cell of a picture as coarse as the model's spacing, the nearest, and those at most a little behind it.
std::vector<std::size_t> Visible(const TargetModel::Level& model, const Eigen::Vector3d& eye_m) {
  const SurfacePoints& surface = model.surface;
  struct Seen {
    std::int64_t u, v;
    double distance_m;
    std::size_t index;
  };
  std::vector<Seen> seen;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : surface.points) centre += p;
  centre /= static_cast<double>(surface.points.size());
  const Eigen::Vector3d ahead = (centre - eye_m).normalized();
  const Eigen::Vector3d right = ahead.unitOrthogonal();
  const Eigen::Vector3d down = ahead.cross(right);
  const double cell = 1.5 * model.spacing_m / (centre - eye_m).norm();
  constexpr double kGrazing = 0.15;  // cosine; flatter faces give no readings worth matching
  for (std::size_t i = 0; i < surface.points.size(); ++i) {
    const Eigen::Vector3d ray = surface.points[i] - eye_m;
    const double distance = ray.norm();
    if (-ray.dot(surface.normals[i]) < kGrazing * distance) continue;
    const double depth = ray.dot(ahead);
    seen.push_back({static_cast<std::int64_t>(std::floor(ray.dot(right) / depth / cell)),
                    static_cast<std::int64_t>(std::floor(ray.dot(down) / depth / cell)), distance, i});
  }
  std::sort(seen.begin(), seen.end(), [](const Seen& a, const Seen& b) {
    return std::tie(a.u, a.v, a.distance_m, a.index) < std::tie(b.u, b.v, b.distance_m, b.index);
  });
  std::vector<std::size_t> visible;
  double nearest = 0.0;
  for (std::size_t k = 0; k < seen.size(); ++k) {
    if (k == 0 || seen[k].u != seen[k - 1].u || seen[k].v != seen[k - 1].v) nearest = seen[k].distance_m;
    if (seen[k].distance_m < nearest + 2.0 * model.spacing_m) visible.push_back(seen[k].index);
  }
  return visible;
}

View ViewOf(const Fit& fit, const Pose& pose) {
  const std::vector<std::size_t> visible = Visible(fit.model, pose.inverse() * fit.eye_m);
  SurfacePoints surface;
  for (const std::size_t i : visible) {
    surface.points.push_back(fit.model.surface.points[i]);
    surface.normals.push_back(fit.model.surface.normals[i]);
  }
  NearestPoints tree(surface.points);
  return {std::move(surface), std::move(tree)};
}

/// The normal equations of a Gauss-Newton step in (translation along the axes of the target, turns).
struct Equations {
  Eigen::MatrixXd normal;
  Eigen::VectorXd right;
  double weight = 0.0;
  double squares = 0.0;

  explicit Equations(Eigen::Index unknowns)
      : normal(Eigen::MatrixXd::Zero(unknowns, unknowns)), right(Eigen::VectorXd::Zero(unknowns)) {}
  void Add(const Eigen::VectorXd& slope, double error, double w) {
    normal.noalias() += w * slope * slope.transpose();
    right.noalias() -= w * error * slope;
    weight += w;
    squares += w * error * error;
  }
};

/// Tukey's biweight: one at zero, zero from the gate on.
double Biweight(double distance, double gate) {
  if (distance >= gate) return 0.0;
  const double r = distance / gate;
  return (1.0 - r * r) * (1.0 - r * r);
}

/// Pulls a point of the model towards its partner along the surface, where they are farther apart than neighbouring
/// samples are: beyond an edge. (Partners within a face are always near, wherever it slides; counting them as well
/// would hold the model where it is.)
void AddSlide(const std::vector<Eigen::Vector3d>& axes, const Eigen::Vector3d& q, const Eigen::Vector3d& m,
              const Eigen::Vector3d& n, double spacing_m, double weight, Equations& equations) {
  const Eigen::Vector3d apart = q - m;
  const Eigen::Vector3d along = apart - n.dot(apart) * n;
  const double length = along.norm();
  if (length <= spacing_m) return;
  const Eigen::Vector3d error = (1.0 - spacing_m / length) * along;
  Eigen::VectorXd slope(equations.right.size());
  const Eigen::Vector3d u = n.unitOrthogonal();
  for (const Eigen::Vector3d& direction : {u, Eigen::Vector3d(n.cross(u))}) {
    slope.head<3>() = -direction;
    for (std::size_t k = 0; k < axes.size(); ++k) {
      slope[static_cast<Eigen::Index>(3 + k)] = -axes[k].dot(q.cross(direction));
    }
    equations.Add(slope, direction.dot(error), weight);
  }
}

Equations Linearize(const Fit& fit, const View& view, const Pose& pose, double gate_m) {
  const std::vector<Eigen::Vector3d>& axes = fit.options.rotation_axes;
  const auto unknowns = static_cast<Eigen::Index>(3 + axes.size());
  Equations equations(unknowns);
  const Pose inverse = pose.inverse();
  Eigen::VectorXd slope(unknowns);
  for (const Eigen::Vector3d& p : fit.scene) {
    const Eigen::Vector3d q = inverse * p;
    const NearestPoints::Hit hit = view.tree.Nearest(q);
    const double weight = Biweight(std::sqrt(hit.squared_m2), gate_m);
    if (weight == 0.0) continue;
    const Eigen::Vector3d& m = view.surface.points[hit.index];
    const Eigen::Vector3d& n = view.surface.normals[hit.index];
    slope.head<3>() = -n;
    for (std::size_t k = 0; k < axes.size(); ++k) slope[static_cast<Eigen::Index>(3 + k)] = -axes[k].dot(q.cross(n));
    equations.Add(slope, n.dot(q - m), weight);
    AddSlide(axes, q, m, n, fit.model.spacing_m, fit.options.edge_weight * weight, equations);
  }
  // The way back counts by the share of the model that it finds, not by how densely either side is sampled.
  const double back =
      fit.options.edge_weight * static_cast<double>(fit.scene.size()) / static_cast<double>(view.surface.points.size());
  for (std::size_t i = 0; i < view.surface.points.size(); ++i) {
    const Eigen::Vector3d& m = view.surface.points[i];
    const NearestPoints::Hit hit = fit.scene_tree.Nearest(pose * m);
    const double weight = back * Biweight(std::sqrt(hit.squared_m2), gate_m);
    if (weight == 0.0) continue;
    AddSlide(axes, inverse * fit.scene_tree.points()[hit.index], m, view.surface.normals[i], fit.scene_spacing_m,
             weight, equations);
  }
  return equations;
}

void Move(const std::vector<Eigen::Vector3d>& axes, const Eigen::VectorXd& step, Pose& pose) {
  pose.translation() += pose.linear() * step.head<3>();
  for (std::size_t k = 0; k < axes.size(); ++k) {
    pose.linear() =
        pose.linear() * Eigen::AngleAxisd(step[static_cast<Eigen::Index>(3 + k)], axes[k]).toRotationMatrix();
  }
}

/// Gauss-Newton with the gate shrinking from `gate_m` to `last_gate_m`.
void Refine(const Fit& fit, double gate_m, double last_gate_m, int iterations, Pose& pose) {
  std::optional<View> view;
  for (int i = 0; i < iterations; ++i) {
    if (i == 0 || i == iterations / 2) view.emplace(ViewOf(fit, pose));
    if (view->surface.points.empty()) return;
    const double share = iterations > 1 ? static_cast<double>(i) / (iterations - 1) : 1.0;
    // Half of the iterations shrink the gate, the rest settle.
    const double gate = gate_m * std::pow(last_gate_m / gate_m, std::min(1.0, 2.0 * share));
    const Equations equations = Linearize(fit, *view, pose, gate);
    Eigen::MatrixXd normal = equations.normal;
    normal.diagonal().array() += 1e-9 * (1.0 + normal.diagonal().maxCoeff());
    const Eigen::VectorXd step = normal.ldlt().solve(equations.right);
    if (!step.allFinite()) return;
    Move(fit.options.rotation_axes, step, pose);
    constexpr double kStill_m = 2e-6;
    if (share >= 0.5 && step.head<3>().norm() < kStill_m) return;
  }
}

struct Quality {
  double fitness = 0.0;
  double explained = 0.0;
  double rms_m = 0.0;
};

Quality Judge(const Fit& fit, const View& view, const Pose& pose) {
  Quality quality;
  if (view.surface.points.empty()) return quality;
  std::size_t met = 0;
  for (const Eigen::Vector3d& m : view.surface.points) {
    met += fit.scene_tree.Nearest(pose * m).squared_m2 < kNear_m * kNear_m ? 1 : 0;
  }
  quality.fitness = static_cast<double>(met) / static_cast<double>(view.surface.points.size());
  const Pose inverse = pose.inverse();
  std::size_t near = 0;
  double squares = 0.0;
  for (const Eigen::Vector3d& p : fit.scene) {
    const Eigen::Vector3d q = inverse * p;
    const NearestPoints::Hit hit = view.tree.Nearest(q);
    if (hit.squared_m2 >= kNear_m * kNear_m) continue;
    ++near;
    const double off = view.surface.normals[hit.index].dot(q - view.surface.points[hit.index]);
    squares += off * off;
  }
  quality.explained = fit.scene.empty() ? 0.0 : static_cast<double>(near) / static_cast<double>(fit.scene.size());
  quality.rms_m = near > 0 ? std::sqrt(squares / static_cast<double>(near)) : 0.0;
  return quality;
}

Eigen::Vector3d Mean(const Points& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) sum += p;
  return sum / static_cast<double>(points.size());
}

/// Where fits of a cluster start: the middle of what is seen of the model at its middle, or, thorough, around it as
/// well, for clusters of which a part is hidden.
std::vector<Eigen::Vector3d> StartOffsets(bool thorough, double radius_m) {
  std::vector<Eigen::Vector3d> offsets = {Eigen::Vector3d::Zero()};
  if (!thorough) return offsets;
  constexpr double kAside = 0.5;  // of the model's radius
  for (const double sign : {-1.0, 1.0}) {
    for (int axis = 0; axis < 3; ++axis) offsets.push_back(sign * kAside * radius_m * Eigen::Vector3d::Unit(axis));
  }
  return offsets;
}

/// The fit of one cluster.
Registration RegisterCluster(const Points& cluster, const TargetModel& model, const Eigen::Matrix3d& orientation,
                             const Eigen::Vector3d& eye_m, const RegistrationOptions& options, bool thorough) {
  constexpr double kRoughSpacing_m = 0.016;
  const Points rough_scene = Thinned(cluster, kRoughSpacing_m);
  const NearestPoints rough_tree(rough_scene);
  const Fit rough{rough_scene, rough_tree, model.coarse(), options, eye_m, kRoughSpacing_m};
  const Eigen::Vector3d centre = Mean(rough_scene);

  Pose best = Pose::Identity();
  double best_score = -1.0;
  const std::vector<Eigen::Vector3d> offsets = StartOffsets(thorough, model.radius_m());
  std::vector<double> turns = {0.0, options.start_turn_rad, -options.start_turn_rad};
  if (thorough) turns.insert(turns.end(), {2.0 * options.start_turn_rad, -2.0 * options.start_turn_rad});
  for (const double turn : turns) {
    if (turn != 0.0 && options.rotation_axes.empty()) continue;
    Pose start = Pose::Identity();
    start.linear() = orientation;
    if (turn != 0.0) start.linear() = orientation * Eigen::AngleAxisd(turn, options.rotation_axes.front());
    // The middle of what can be seen of the model goes to the middle of the cluster.
    start.translation() = centre - start.linear() * model.center_m();
    Eigen::Vector3d seen = Eigen::Vector3d::Zero();
    const std::vector<std::size_t> visible = Visible(model.coarse(), start.inverse() * eye_m);
    for (const std::size_t i : visible) seen += model.coarse().surface.points[i];
    if (visible.empty()) continue;
    start.translation() = centre - start.linear() * (seen / static_cast<double>(visible.size()));
    for (const Eigen::Vector3d& offset : offsets) {
      Pose pose = start;
      pose.translation() += offset;
      Refine(rough, 0.08, 0.04, 12, pose);
      const Quality quality = Judge(rough, ViewOf(rough, pose), pose);
      const double score = quality.fitness + quality.explained - quality.rms_m / kNear_m;
      if (score > best_score) {
        best_score = score;
        best = pose;
      }
    }
  }

  const NearestPoints tree(cluster);
  const Fit fine{cluster, tree, model.fine(), options, eye_m, options.scene_spacing_m};
  Refine(fine, 0.035, 0.015, 12, best);
  const View view = ViewOf(fine, best);
  const Quality quality = Judge(fine, view, best);
  Registration result;
  result.world_T_target = best;
  result.fitness = quality.fitness;
  result.explained = quality.explained;
  result.rms_m = quality.rms_m;
  result.points = static_cast<int>(cluster.size());
  if (view.surface.points.empty()) return result;
  const Equations equations = Linearize(fine, view, best, 0.012);
  const auto unknowns = equations.normal.rows();
  const double variance = quality.rms_m * quality.rms_m;
  result.covariance = variance * equations.normal.ldlt().solve(Eigen::MatrixXd::Identity(unknowns, unknowns));
  return result;
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
    if (!good) throw InputError("registration options", what);
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
                      const Eigen::Vector3d& eye_m, const RegistrationOptions& options) {
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
  for (const Cluster& cluster : clusters) {
    Registration fit = RegisterCluster(cluster.points, model, nominal_orientation, eye_m, options, false);
    if (fit.fitness > best.fitness) best = std::move(fit);
  }
  if (best.fitness < kSureFitness || best.rms_m > kSureRms_m) {
    // Something may stand before the target and cut it in two: all that is near belongs to it, and fits start aside
    // too.
    for (const Cluster& cluster : clusters) {
      Points company;
      for (const Eigen::Vector3d& p : thinned) {
        if ((p - cluster.densest_m).norm() < 2.0 * model.radius_m()) company.push_back(p);
      }
      Registration fit = RegisterCluster(company, model, nominal_orientation, eye_m, options, true);
      if (fit.fitness - fit.rms_m / kNear_m > best.fitness - best.rms_m / kNear_m) best = std::move(fit);
    }
  }
  best.found = best.fitness >= options.least_fitness;
  if (!best.found) {
    best.reason = fmt::format("the best fit meets {:.0f} % of what should be seen of the target, below {:.0f} %",
                              100.0 * best.fitness, 100.0 * options.least_fitness);
  }
  return best;
}

}  // namespace feeler::perception
