#include "feeler/perception/icp_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <tuple>
#include <utility>

#include "feeler/core/lattice_grid.h"

namespace feeler::perception {
namespace {

// Of three coordinates and at most as many turns, without the heap.
constexpr int kMostUnknowns = 6;
using SmallMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMostUnknowns, kMostUnknowns>;
using SmallVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMostUnknowns, 1>;

/// The part of the model that the eye sees. Only that may be matched: the back of a plate is as near as its front.
struct View {
  SurfacePoints surface;
  NearestPoints tree;
};

View ViewOf(const IcpFit& fit, const Pose& pose) {
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
  SmallMatrix normal;
  SmallVector right;

  explicit Equations(Eigen::Index unknowns)
      : normal(SmallMatrix::Zero(unknowns, unknowns)), right(SmallVector::Zero(unknowns)) {}
  void Add(const SmallVector& slope, double error, double weight) {
    normal.noalias() += weight * slope * slope.transpose();
    right.noalias() -= weight * error * slope;
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
  SmallVector slope(equations.right.size());
  const Eigen::Vector3d u = n.unitOrthogonal();
  for (const Eigen::Vector3d& direction : {u, Eigen::Vector3d(n.cross(u))}) {
    slope.head<3>() = -direction;
    for (std::size_t k = 0; k < axes.size(); ++k) {
      slope[static_cast<Eigen::Index>(3 + k)] = -axes[k].dot(q.cross(direction));
    }
    equations.Add(slope, direction.dot(error), weight);
  }
}

Equations Linearize(const IcpFit& fit, const View& view, const Pose& pose, double gate_m) {
  const std::vector<Eigen::Vector3d>& axes = fit.options.rotation_axes;
  const auto unknowns = static_cast<Eigen::Index>(3 + axes.size());
  Equations equations(unknowns);
  const Pose inverse = pose.inverse();
  SmallVector slope(unknowns);
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

void Move(const std::vector<Eigen::Vector3d>& axes, const SmallVector& step, Pose& pose) {
  pose.translation() += pose.linear() * step.head<3>();
  for (std::size_t k = 0; k < axes.size(); ++k) {
    pose.linear() =
        pose.linear() * Eigen::AngleAxisd(step[static_cast<Eigen::Index>(3 + k)], axes[k]).toRotationMatrix();
  }
}

}  // namespace

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
    seen.push_back({StretchOf(ray.dot(right) / depth / cell), StretchOf(ray.dot(down) / depth / cell), distance, i});
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

void Refine(const IcpFit& fit, double gate_m, double last_gate_m, int iterations, Pose& pose) {
  std::optional<View> view;
  for (int i = 0; i < iterations; ++i) {
    if (i == 0 || i == iterations / 2) view.emplace(ViewOf(fit, pose));
    if (view->surface.points.empty()) return;
    const double share = iterations > 1 ? static_cast<double>(i) / (iterations - 1) : 1.0;
    // Half of the iterations shrink the gate, the rest settle.
    const double gate = gate_m * std::pow(last_gate_m / gate_m, std::min(1.0, 2.0 * share));
    const Equations equations = Linearize(fit, *view, pose, gate);
    SmallMatrix normal = equations.normal;
    normal.diagonal().array() += 1e-9 * (1.0 + normal.diagonal().maxCoeff());
    const SmallVector step = normal.ldlt().solve(equations.right);
    if (!step.allFinite()) return;
    Move(fit.options.rotation_axes, step, pose);
    constexpr double kStill_m = 1e-5;
    if (share >= 0.5 && step.head<3>().norm() < kStill_m) return;
  }
}

FitQuality Judge(const IcpFit& fit, const Pose& pose, Eigen::MatrixXd* covariance) {
  FitQuality quality;
  const View view = ViewOf(fit, pose);
  if (view.surface.points.empty() || fit.scene.empty()) return quality;
  constexpr double kMet_m2 = kMet_m * kMet_m;
  std::size_t met = 0;
  for (const Eigen::Vector3d& m : view.surface.points) {
    met += fit.scene_tree.Nearest(pose * m).squared_m2 < kMet_m2 ? 1 : 0;
  }
  quality.fitness = static_cast<double>(met) / static_cast<double>(view.surface.points.size());
  const Pose inverse = pose.inverse();
  std::size_t near = 0;
  double squares = 0.0;
  for (const Eigen::Vector3d& p : fit.scene) {
    const Eigen::Vector3d q = inverse * p;
    const NearestPoints::Hit hit = view.tree.Nearest(q);
    if (hit.squared_m2 >= kMet_m2) continue;
    ++near;
    const double off = view.surface.normals[hit.index].dot(q - view.surface.points[hit.index]);
    squares += off * off;
  }
  quality.explained = static_cast<double>(near) / static_cast<double>(fit.scene.size());
  quality.rms_m = near > 0 ? std::sqrt(squares / static_cast<double>(near)) : 0.0;
  if (covariance != nullptr) {
    const Equations equations = Linearize(fit, view, pose, kMet_m);
    const auto unknowns = equations.normal.rows();
    *covariance =
        quality.rms_m * quality.rms_m * equations.normal.ldlt().solve(SmallMatrix::Identity(unknowns, unknowns));
  }
  return quality;
}

}  // namespace feeler::perception
