#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "feeler/core/orientation_lattice.h"
#include "feeler/core/task.h"
#include "feeler/planner/contact/contact_map.h"

namespace feeler::planner::testing {

/// The numbers of a pipe task without models: x, y, yaw and pitch are uncertain.
inline Task MakePipeTask(int most_xy = 10, int most_angles = 6) {
  Task task;
  task.name = "synthetic-pipe";
  task.axes = {{AxisKind::kX, 0.002, 2, most_xy},
               {AxisKind::kY, 0.002, 2, most_xy},
               {AxisKind::kYaw, 0.05, 2, most_angles},
               {AxisKind::kPitch, 0.05, 2, most_angles}};
  task.start_offset_m = Eigen::Vector3d(0.02, 0.0, 0.02);
  task.insertion_depth_m = 0.02;
  task.workspace_m = Eigen::Vector3d(0.08, 0.07, 0.036);
  return task;
}

inline double SegmentDistance(const Eigen::Vector3d& p1, const Eigen::Vector3d& q1, const Eigen::Vector3d& p2,
                              const Eigen::Vector3d& q2) {
  const Eigen::Vector3d d1 = q1 - p1;
  const Eigen::Vector3d d2 = q2 - p2;
  const Eigen::Vector3d r = p1 - p2;
  const double a = d1.dot(d1);
  const double b = d1.dot(d2);
  const double c = d1.dot(r);
  const double e = d2.dot(d2);
  const double f = d2.dot(r);
  const double denominator = a * e - b * b;
  double s = denominator > 1e-12 ? std::clamp((b * f - c * e) / denominator, 0.0, 1.0) : 0.0;
  double t = (b * s + f) / e;
  if (t < 0.0) {
    t = 0.0;
    s = std::clamp(-c / a, 0.0, 1.0);
  } else if (t > 1.0) {
    t = 1.0;
    s = std::clamp((b - c) / a, 0.0, 1.0);
  }
  return (p1 + s * d1 - p2 - t * d2).norm();
}

/// Capsules in place of an upright elbow with a sideways arm and of a pipe pointing down, one layer per orientation of
/// the task's lattice; steps are swept by samples. `scale` shrinks all lengths but the cell.
inline std::shared_ptr<const ContactMap> MakePipeMap(const Task& task, double scale = 1.0) {
  const CellBox domain = DisplacementsOf(task);
  const double reach_m = 0.046 * scale;
  std::vector<ContactMap::Layer> layers;
  for (int o = 0; o < LatticeOrientations(task); ++o) {
    const Eigen::Quaterniond turn = LatticeOrientation(task, o);
    const Eigen::Vector3d top = turn * Eigen::Vector3d(0, 0, -0.046 * scale);
    const Eigen::Vector3d foot = turn * Eigen::Vector3d(0, 0, -0.09 * scale);
    const Eigen::Vector3d hand = turn * Eigen::Vector3d(0.1 * scale, 0, -0.06 * scale);
    const auto hits = [&](const Eigen::Vector3d& cells) {
      const Eigen::Vector3d tip = cells * task.cell_m;
      const Eigen::Vector3d end = tip + Eigen::Vector3d(0, 0, 0.12);
      return SegmentDistance(tip, end, top, foot) < reach_m || SegmentDistance(tip, end, foot, hand) < reach_m;
    };
    const Cell size = domain.Size();
    const auto count = static_cast<std::size_t>(domain.Count());
    const auto index = [&](const Cell& at) {
      const Cell c = at - domain.min;
      return static_cast<std::size_t>((std::int64_t{c.z()} * size.y() + c.y()) * size.x() + c.x());
    };
    ContactMap::Layer layer;
    layer.blocked.resize(count);
    for (auto& travel : layer.travel) travel.assign(count, 0.0F);
    const auto for_each = [&](bool backward, auto f) {
      for (std::size_t k = 0; k < count; ++k) {
        const std::size_t i = backward ? count - 1 - k : k;
        const auto c = static_cast<int>(i);
        f(i, Cell(domain.min + Cell(c % size.x(), c / size.x() % size.y(), c / size.x() / size.y())));
      }
    };
    const Eigen::Vector3d phase(0.25, 0.25, 0.25);
    for_each(false, [&](std::size_t i, const Cell& at) { layer.blocked[i] = hits(at.cast<double>() + phase) ? 1 : 0; });
    for (const Direction d : kDirections) {
      std::vector<float>& travel = layer.travel[static_cast<std::size_t>(IndexOf(d))];
      for_each(SignOf(d) > 0, [&](std::size_t i, const Cell& at) {
        const Cell next = at + UnitCell(d);
        if (layer.blocked[i] != 0) return;
        if (!domain.Contains(next)) {
          travel[i] = ContactMap::kUnlimited;
          return;
        }
        for (double part = 0.25; part < 1.01; part += 0.25) {
          if (!hits(at.cast<double>() + phase + part * UnitVector(d))) continue;
          travel[i] = static_cast<float>(part - 0.125);
          return;
        }
        travel[i] = std::min(ContactMap::kUnlimited, travel[index(next)] + 1.0F);
      });
    }
    layers.push_back(std::move(layer));
  }
  return std::make_shared<ContactMap>(domain, std::move(layers), Eigen::Vector3d::Constant(0.25), 0.125);
}

}  // namespace feeler::planner::testing
