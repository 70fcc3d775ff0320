#include "feeler/env/vision/task_views.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "feeler/core/error.h"
#include "feeler/env/model/geom_shapes.h"
#include "feeler/env/model/mujoco_handles.h"
#include "feeler/env/vision/renderer.h"

namespace feeler::env {
namespace {

using Points = std::vector<Eigen::Vector3d>;

/// Thinner slices have no volume that MuJoCo takes.
constexpr double kThinnest_m = 1e-5;
/// How far a cut face stands out, so that it is seen in its own colour.
constexpr double kCutFace_m = 2e-5;
constexpr double kFieldOfView_rad = std::numbers::pi / 4;

/// Points whose convex hull is the geom, in the frame of its body; curved geoms by a fine polytope.
Points HullPoints(const mjModel& model, int geom, int body) {
  const Pose pose = GeomInBody(model, geom, body);
  Points points;
  const mjtNum* size = model.geom_size + 3 * geom;
  const auto add = [&](double x, double y, double z) { points.push_back(pose * Eigen::Vector3d(x, y, z)); };
  const int type = model.geom_type[geom];
  if (type == mjGEOM_MESH) {
    for (const Eigen::Vector3d& p : MeshHull(model, geom)) points.push_back(pose * p);
  } else if (type == mjGEOM_BOX) {
    for (int c = 0; c < 8; ++c)
      add((c & 1) != 0 ? size[0] : -size[0], (c & 2) != 0 ? size[1] : -size[1], (c & 4) != 0 ? size[2] : -size[2]);
  } else if (type == mjGEOM_CYLINDER) {
    for (int k = 0; k < 64; ++k) {
      const double a = 2 * std::numbers::pi * k / 64;
      for (const double z : {-size[1], size[1]}) add(size[0] * std::cos(a), size[0] * std::sin(a), z);
    }
  } else if (type == mjGEOM_SPHERE || type == mjGEOM_ELLIPSOID || type == mjGEOM_CAPSULE) {
    const Eigen::Vector3d radii =
        type == mjGEOM_ELLIPSOID ? Eigen::Vector3d(size[0], size[1], size[2]) : Eigen::Vector3d::Constant(size[0]);
    for (int i = 0; i <= 12; ++i) {
      const double b = std::numbers::pi * (i / 12.0 - 0.5);
      const double shift = type == mjGEOM_CAPSULE ? (i < 6 ? -size[1] : size[1]) : 0.0;
      for (int k = 0; k < 24; ++k) {
        const double a = 2 * std::numbers::pi * k / 24;
        add(radii.x() * std::cos(b) * std::cos(a), radii.y() * std::cos(b) * std::sin(a),
            radii.z() * std::sin(b) + shift);
      }
    }
  }
  return points;
}

struct Slice {
  Points kept;  ///< hull of what is behind the plane
  Points face;  ///< points of the cut, on the plane
};

/// What of a hull is at or beyond the plane x[axis] = 0.
Slice Behind(const Points& points, int axis) {
  Slice slice;
  Points front;
  for (const Eigen::Vector3d& p : points) (p[axis] >= 0 ? slice.kept : front).push_back(p);
  for (const Eigen::Vector3d& a : slice.kept) {
    for (const Eigen::Vector3d& b : front) {
      Eigen::Vector3d on = a + (b - a) * (a[axis] / (a[axis] - b[axis]));
      on[axis] = 0;
      slice.face.push_back(on);
    }
  }
  return slice;
}

/// The convex hull of points in the plane across `axis` (Andrew 1979); empty when they span no area.
Points PlanarHull(Points points, int axis) {
  if (points.size() < 3) return {};
  const int u = (axis + 1) % 3;
  const int v = (axis + 2) % 3;
  std::sort(points.begin(), points.end(),
            [&](const auto& a, const auto& b) { return std::pair(a[u], a[v]) < std::pair(b[u], b[v]); });
  Points hull;
  for (int side = 0; side < 2; ++side) {
    const std::size_t start = hull.size();
    for (const Eigen::Vector3d& p : points) {
      while (hull.size() >= start + 2) {
        const Eigen::Vector3d a = hull[hull.size() - 1] - hull[hull.size() - 2];
        const Eigen::Vector3d b = p - hull[hull.size() - 1];
        if (a[u] * b[v] - a[v] * b[u] > 1e-14) break;
        hull.pop_back();
      }
      hull.push_back(p);
    }
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  double twice = 0;
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Eigen::Vector3d& a = hull[i];
    const Eigen::Vector3d& b = hull[(i + 1) % hull.size()];
    twice += a[u] * b[v] - a[v] * b[u];
  }
  return hull.size() < 3 || std::abs(twice) < 2e-10 ? Points{} : hull;
}

/// Collects convex bodies as an MJCF model that only shows.
class Showcase {
 public:
  void Add(const Points& points, const std::string& rgba) {
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3d& p : points) box.extend(p);
    if (points.size() < 4 || box.sizes().minCoeff() < kThinnest_m) return;
    std::string vertices;
    for (const Eigen::Vector3d& p : points) vertices += fmt::format("{:.9g} {:.9g} {:.9g} ", p.x(), p.y(), p.z());
    assets_ += fmt::format("<mesh name=\"m{}\" vertex=\"{}\"/>\n", count_, vertices);
    geoms_ +=
        fmt::format("<geom type=\"mesh\" mesh=\"m{}\" rgba=\"{}\" contype=\"0\" conaffinity=\"0\"/>\n", count_, rgba);
    ++count_;
    bounds_.extend(box);
  }

  Image Render(const Eigen::Vector3d& look_at, double span_m, double azimuth_deg, double elevation_deg,
               const TaskViewOptions& options) const {
    if (count_ == 0)
      throw InputError("rendering", "there is nothing to see", "does the task have geoms that can collide?");
    const double distance = 0.5 * span_m / std::tan(0.5 * kFieldOfView_rad);
    const std::string xml = fmt::format(
        "<mujoco><statistic extent=\"{0}\" center=\"{1} {2} {3}\"/><visual><map znear=\"0.01\" zfar=\"100\"/>"
        "<headlight ambient=\"0.45 0.45 0.45\" diffuse=\"0.5 0.5 0.5\" specular=\"0 0 0\"/></visual>"
        "<asset><texture name=\"sky\" type=\"skybox\" builtin=\"flat\" rgb1=\"1 1 1\" rgb2=\"1 1 1\" width=\"64\" "
        "height=\"64\"/>\n{4}</asset>"
        "<worldbody><light pos=\"0 0 1\" dir=\"0.3 0.3 -1\" directional=\"true\" diffuse=\"0.3 0.3 0.3\" "
        "castshadow=\"false\"/>\n{5}</worldbody></mujoco>",
        span_m, look_at.x(), look_at.y(), look_at.z(), assets_, geoms_);
    RendererOptions renderer_options;
    renderer_options.width = options.width;
    renderer_options.height = options.height;
    renderer_options.shadows = false;
    const std::shared_ptr<const mjModel> model(CompileMjcf(xml, "picture").release(), ModelDeleter());
    Renderer renderer(model, renderer_options);
    const DataHandle data = MakeData(*model);
    mj_forward(model.get(), data.get());
    return renderer.Color(*data, FreeCamera{look_at, distance, azimuth_deg, elevation_deg});
  }

  const Eigen::AlignedBox3d& bounds() const { return bounds_; }

 private:
  int count_ = 0;
  std::string assets_;
  std::string geoms_;
  Eigen::AlignedBox3d bounds_;
};

struct Colours {
  std::string body;
  std::string cut;
};
const Colours kTarget{"0.62 0.68 0.76 1", "0.28 0.38 0.52 1"};
const Colours kTool{"0.93 0.78 0.52 1", "0.80 0.50 0.12 1"};
const Colours kLid{"0.95 0.35 0.15 0.35", "0.90 0.30 0.10 0.55"};

/// The box around the opening: the lids, or the part of the tool that goes in.
Eigen::AlignedBox3d OpeningBox(const TaskModel& task) {
  Eigen::AlignedBox3d box;
  const mjModel& model = *task.model;
  for (const int geom : task.lid_geoms) {
    for (const Eigen::Vector3d& p : HullPoints(model, geom, task.target_body)) box.extend(p);
  }
  for (const int geom : task.tool_lid_geoms) {
    for (const Eigen::Vector3d& p : HullPoints(model, geom, task.tool_body)) box.extend(p);
  }
  if (!box.isEmpty()) return box;
  for (const int geom : task.tool_geoms) {
    for (const Eigen::Vector3d& p : HullPoints(model, geom, task.tool_body)) {
      if (p.z() <= task.task.insertion_depth_m) box.extend(p);
    }
  }
  return box;
}

}  // namespace

Image RenderTaskSection(const TaskModel& task, const TaskViewOptions& options) {
  const mjModel& model = *task.model;
  Showcase showcase;
  const Eigen::Vector3d tool_at = options.depth_m * UnitVector(task.task.insertion);
  const auto add = [&](int geom, int body, const Eigen::Vector3d& offset, const Colours& colours) {
    Points points = HullPoints(model, geom, body);
    for (Eigen::Vector3d& p : points) p += offset;
    const Slice slice = Behind(points, options.section_axis);
    Points solid = slice.kept;
    const Points face = PlanarHull(slice.face, options.section_axis);
    solid.insert(solid.end(), face.begin(), face.end());
    showcase.Add(solid, colours.body);
    Points raised = face;
    for (Eigen::Vector3d p : face) {
      p[options.section_axis] -= kCutFace_m;
      raised.push_back(p);
    }
    showcase.Add(raised, colours.cut);
  };
  const Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  for (const int geom : task.target_geoms) {
    if (model.geom_type[geom] != mjGEOM_PLANE) add(geom, task.target_body, origin, kTarget);
  }
  if (options.show_tool) {
    for (const int geom : task.tool_geoms) add(geom, task.tool_body, tool_at, kTool);
  }
  if (options.show_lids) {
    for (const int geom : task.lid_geoms) add(geom, task.target_body, origin, kLid);
    if (options.show_tool) {
      for (const int geom : task.tool_lid_geoms) add(geom, task.tool_body, tool_at, kLid);
    }
  }
  const Eigen::AlignedBox3d opening = OpeningBox(task);
  const double span = 2.2 * std::max({opening.sizes().maxCoeff(), task.task.insertion_depth_m, 4e-3});
  Eigen::Vector3d look = opening.center();
  look[options.section_axis] = 0;
  return showcase.Render(look, span, options.section_axis == 1 ? 90 : 0, 0, options);
}

Image RenderTaskMouth(const TaskModel& task, const TaskViewOptions& options) {
  const mjModel& model = *task.model;
  Showcase showcase;
  // Of a tool that has the opening the tool is shown, from below.
  const bool of_tool = task.lid_geoms.empty() && !task.tool_lid_geoms.empty();
  const int body = of_tool ? task.tool_body : task.target_body;
  for (const int geom : of_tool ? task.tool_geoms : task.target_geoms) {
    if (model.geom_type[geom] != mjGEOM_PLANE)
      showcase.Add(HullPoints(model, geom, body), (of_tool ? kTool : kTarget).body);
  }
  if (options.show_lids) {
    for (const int geom : of_tool ? task.tool_lid_geoms : task.lid_geoms)
      showcase.Add(HullPoints(model, geom, body), kLid.body);
  }
  const Eigen::AlignedBox3d opening = OpeningBox(task);
  Eigen::Vector3d look = opening.center();
  look.z() = of_tool ? opening.min().z() : opening.max().z();
  const double span = 2.4 * std::max(opening.sizes().head<2>().maxCoeff(), 4e-3);
  return showcase.Render(look, span, 115, of_tool ? 62 : -62, options);
}

}  // namespace feeler::env
