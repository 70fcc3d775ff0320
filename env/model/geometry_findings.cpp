#include "feeler/env/model/geometry_findings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "feeler/env/model/geom_shapes.h"
#include "feeler/env/model/mouth_clearance.h"
#include "feeler/env/model/overlap_judge.h"

namespace feeler::env {
namespace {

using Severity = TaskFinding::Severity;

/// Beyond these a part is no part for an arm, but one in millimetres.
constexpr double kLongestTool_m = 1.5;
constexpr double kLongestTarget_m = 4.0;
/// Of the hull, what the surface of a mesh encloses; below: the hull fills what the mesh leaves open. A convex mesh has
/// 1 up to the rounding of its vertices.
constexpr double kConvexShare = 0.9995;

std::string Numeric(const std::string& where, const char* field) {
  return fmt::format("{}: <custom><numeric name=\"{}\">", where, field);
}

std::string Geom(const std::string& where, const mjModel& model, int geom) {
  return fmt::format("{}: <geom name=\"{}\">", where, model.names + model.name_geomadr[geom]);
}

std::string Place(const Eigen::Vector3d& p_m) {
  return fmt::format("({:.1f}, {:.1f}, {:.1f}) mm", p_m.x() * 1000, p_m.y() * 1000, p_m.z() * 1000);
}

double TriangleVolume(const mjModel& model, int mesh, const int* corners) {
  const float* base = model.mesh_vert + 3 * model.mesh_vertadr[mesh];
  const auto at = [&](int i) { return Eigen::Map<const Eigen::Vector3f>(base + 3 * i).cast<double>(); };
  const Eigen::Vector3d a = at(corners[0]);
  const Eigen::Vector3d b = at(corners[1]);
  const Eigen::Vector3d c = at(corners[2]);
  return a.dot(b.cross(c)) / 6;
}

/// What the surface of a mesh encloses, as a share of its convex hull; 1 where that is not known.
double ConvexShare(const mjModel& model, int geom) {
  const int mesh = model.geom_dataid[geom];
  if (model.geom_type[geom] != mjGEOM_MESH || mesh < 0 || model.mesh_graphadr[mesh] < 0) return 1;
  double volume = 0;
  for (int f = 0; f < model.mesh_facenum[mesh]; ++f) {
    volume += TriangleVolume(model, mesh, model.mesh_face + 3 * (model.mesh_faceadr[mesh] + f));
  }
  const int* graph = model.mesh_graph + model.mesh_graphadr[mesh];
  const int vertices = graph[0];
  const int faces = graph[1];
  const int* hull_faces = graph + 2 + 2 * vertices + vertices + 3 * faces;
  double hull = 0;
  for (int f = 0; f < faces; ++f) hull += TriangleVolume(model, mesh, hull_faces + 3 * f);
  return hull == 0 ? 1 : std::abs(volume) / std::abs(hull);
}

void AddMillimetres(const TaskModel& task_model, const std::string& where, TaskFindings& findings) {
  const mjModel& model = *task_model.model;
  for (const bool tool : {true, false}) {
    double extent = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const auto span = SpanOf(model, tool ? task_model.tool_geoms : task_model.target_geoms,
                               tool ? task_model.tool_body : task_model.target_body, Eigen::Vector3d::Unit(axis));
      if (span[1] > span[0]) extent = std::max(extent, span[1] - span[0]);
    }
    if (extent <= (tool ? kLongestTool_m : kLongestTarget_m)) continue;
    findings.push_back({Severity::kError, "millimetres",
                        fmt::format("{}: <body name=\"{}\">", where, tool ? "tool" : "target"),
                        fmt::format("is {:.4g} m long: its sizes look like millimetres, MJCF is in metres", extent),
                        "give its <mesh> scale=\"0.001 0.001 0.001\", or divide its sizes by 1000"});
  }
}

/// The whole way in, a little short of the end, so that a tool that rests on the floor is not taken for a collision.
constexpr int kSteps = 50;

/// Depth at which the way in is blocked for a tool displaced by `offset_m`; empty if it is free.
std::optional<double> BlockedAt(OverlapJudge& judge, const Task& task, const Eigen::Vector3d& offset_m) {
  for (int i = 0; i < kSteps; ++i) {
    const double depth_m = task.insertion_depth_m * i / kSteps;
    if (judge.Overlap(offset_m + UnitVector(task.insertion) * depth_m)) return depth_m;
  }
  return std::nullopt;
}

/// The angle about the insertion axis at which the tool would go in, degrees; 0 if none of three.
int TurnThatFits(const TaskModel& task_model) {
  const Task& task = task_model.task;
  for (const int degrees : {180, 90, 270}) {
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(degrees * EIGEN_PI / 180, UnitVector(task.insertion)));
    OverlapJudge judge(task_model, GeomsOf(task_model, Opening::kOpen), turn);
    if (!BlockedAt(judge, task, Eigen::Vector3d::Zero())) return degrees;
  }
  return 0;
}

/// The smallest displacement across the insertion, on a grid of 0.5 mm to 15 mm, with which the tool goes in.
std::optional<Eigen::Vector3d> OffsetThatFits(const TaskModel& task_model, const Eigen::Vector3d& along_m) {
  const Task& task = task_model.task;
  OverlapJudge judge(task_model, GeomsOf(task_model, Opening::kOpen));
  const int axis = AxisOf(task.insertion);
  std::vector<Eigen::Vector3d> offsets;
  constexpr int kHalf = 30;
  for (int u = -kHalf; u <= kHalf; ++u) {
    for (int v = -kHalf; v <= kHalf; ++v) {
      Eigen::Vector3d offset = Eigen::Vector3d::Zero();
      offset[(axis + 1) % 3] = 5e-4 * u;
      offset[(axis + 2) % 3] = 5e-4 * v;
      offsets.push_back(offset);
    }
  }
  std::stable_sort(offsets.begin(), offsets.end(), [](const auto& a, const auto& b) { return a.norm() < b.norm(); });
  const Eigen::Vector3d deep = UnitVector(task.insertion) * (0.9 * task.insertion_depth_m);
  for (const Eigen::Vector3d& offset : offsets) {
    // Beside a small target the way is free as well: the tool at the mouth has to be held by walls on both sides.
    if (judge.Overlap(offset + along_m + deep) || BlockedAt(judge, task, offset + along_m)) continue;
    bool held = true;
    for (int side = 1; side < 3; ++side) {
      for (const double sign : {1.0, -1.0}) {
        Eigen::Vector3d aside = Eigen::Vector3d::Zero();
        aside[(axis + side) % 3] = sign * 0.004;
        held = held && judge.Overlap(offset + along_m + deep + aside);
      }
    }
    if (held) return offset + along_m;
  }
  return std::nullopt;
}

/// What a blocked way in looks like, and how it is mended.
struct Cause {
  std::string kind;
  std::string looks;
  std::string mend;
};

Cause CauseOf(const TaskModel& task_model, const OverlapJudge::Meeting& meeting) {
  const mjModel& model = *task_model.model;
  const Task& task = task_model.task;
  for (const int geom : {meeting.target_geom, meeting.tool_geom}) {
    const double share = ConvexShare(model, geom);
    if (share >= kConvexShare) continue;
    return {
        "hull",
        fmt::format("; \"{}\" is one mesh that encloses {:.2f} % of its convex hull, and MuJoCo takes the hull: it "
                    "fills the opening",
                    model.names + model.name_geomadr[geom], 100 * share),
        "three ways: feeler task import makes convex pieces of the CAD file; or decompose the mesh (CoACD, V-HACD), a "
        "geom a piece; or build walls and floor from boxes"};
  }
  if (const int degrees = TurnThatFits(task_model); degrees != 0) {
    return {"upside-down", fmt::format("; turned by {} degrees about {} it goes in", degrees, ToString(task.insertion)),
            fmt::format("turn the geoms of the tool, or of the target, by {} degrees about the insertion axis{}",
                        degrees, degrees == 180 ? ": the key is upside down" : "")};
  }
  const Eigen::Vector3d inward = UnitVector(task.insertion);
  const double tip_m = SpanOf(model, task_model.tool_geoms, task_model.tool_body, inward)[1];
  for (const Eigen::Vector3d& along : {Eigen::Vector3d(Eigen::Vector3d::Zero()), Eigen::Vector3d(-tip_m * inward)}) {
    const auto offset = OffsetThatFits(task_model, along);
    if (!offset || offset->norm() < 1e-6) continue;
    return {
        "origins",
        fmt::format("; displaced by {} it goes in: the origin of the tool is not the centre of its tip face, or that "
                    "of the target not the centre of the mouth",
                    Place(*offset)),
        fmt::format("move the geoms of the tool by {}, or those of the target by the opposite", Place(*offset))};
  }
  if (tip_m > 1e-4) {
    return {"origins", fmt::format("; the tip of the tool stands {:.2f} mm ahead of its origin", tip_m * 1000),
            "put the origin of the body tool at the centre of its tip face"};
  }
  return {"way-in", "", "check the origins of the bodies tool and target, the opening, or the depth"};
}

void AddWayIn(const TaskModel& task_model, const std::string& where, TaskFindings& findings) {
  const Task& task = task_model.task;
  OverlapJudge open(task_model, task_model.target_geoms);
  const std::optional<double> depth_m = BlockedAt(open, task, Eigen::Vector3d::Zero());
  if (!depth_m) return;
  const auto meeting = open.Meet(UnitVector(task.insertion) * *depth_m);
  const mjModel& model = *task_model.model;
  const Cause cause = CauseOf(task_model, *meeting);
  findings.push_back(
      {Severity::kError, cause.kind, Numeric(where, "feeler_insertion_depth"),
       fmt::format(
           "the tool, aligned, meets the target {:.4f} m beyond the mouth, before it is inserted: {} meets {} at "
           "{} of the target frame{}",
           *depth_m, NameOfTaskGeom(model, meeting->tool_geom), NameOfTaskGeom(model, meeting->target_geom),
           Place(meeting->point_m), cause.looks),
       cause.mend});
}

std::string ClearanceText(const TaskModel& task_model) {
  const auto clearance = ClearanceAtMouth(task_model);
  std::string text;
  for (int axis = 0; axis < 3; ++axis) {
    if (axis == AxisOf(task_model.task.insertion)) continue;
    const auto& c = clearance[static_cast<std::size_t>(axis)];
    text += fmt::format("{}{} -{:.3f} +{:.3f} mm", text.empty() ? "" : ", ", "xyz"[axis], c[0] * 1000, c[1] * 1000);
  }
  return text;
}

void AddTolerance(const TaskModel& task_model, const std::string& where, TaskFindings& findings) {
  const Task& task = task_model.task;
  Eigen::Vector3d lateral_m;
  for (int axis = 0; axis < 3; ++axis) lateral_m[axis] = task.tolerance.Lateral(axis);
  OverlapJudge open(task_model, task_model.target_geoms);
  if (EntersDisplaced(open, task, lateral_m)) return;
  const Eigen::Vector3d largest_m = LargestLateralTolerance(task_model);
  const int first = AxisOf(task.insertion) == 0 ? 1 : 0;
  const int second = AxisOf(task.insertion) == 2 ? 1 : 2;
  const auto down = [](double value_m) { return std::floor(value_m * 1e7) / 1e7; };
  const double both_m = LargestLateralOnBoth(task_model);
  const std::string given = task.tolerance.one_lateral()
                                ? fmt::format("{} m along each axis", task.tolerance.lateral_m)
                                : fmt::format("{} and {} m along its two axes", lateral_m[first], lateral_m[second]);
  std::string mend = fmt::format(
      "the tolerance is at most the clearance and the lead-in chamfer: at most {:.3g} m here", down(both_m));
  if (std::max(largest_m[first], largest_m[second]) > 1.05 * both_m) {
    mend += fmt::format(", or per axis \"{:.3g} {:.3g}\"", down(largest_m[first]), down(largest_m[second]));
  }
  findings.push_back({Severity::kError, "tolerance", Numeric(where, "feeler_tolerance_lateral"),
                      fmt::format("a tool displaced by {} misses the opening: measured clearance at the mouth {}",
                                  given, ClearanceText(task_model)),
                      mend});
}

/// Whether the tool at this start offset is free of the target under all hypotheses of the largest extents.
bool StartIsFree(const TaskModel& task_model, const Eigen::Vector3d& start_offset_m,
                 std::optional<OverlapJudge::Meeting>& meeting) {
  const Task& task = task_model.task;
  const Eigen::Vector3d half_m = (LargestPositionExtents(task) - Cell::Ones()).cast<double>() * (task.cell_m / 2);
  for (const Eigen::Quaterniond& orientation : TargetOrientations(task)) {
    OverlapJudge closed(task_model, GeomsOf(task_model, Opening::kClosed), orientation);
    for (int corner = 0; corner < 27; ++corner) {
      const Eigen::Vector3d sign(corner % 3 - 1, corner / 3 % 3 - 1, corner / 9 - 1);
      if (!closed.Overlap(start_offset_m - sign.cwiseProduct(half_m))) continue;
      meeting = closed.Meet(start_offset_m - sign.cwiseProduct(half_m));
      return false;
    }
  }
  return true;
}

void AddStart(const TaskModel& task_model, const std::string& where, TaskFindings& findings) {
  const Task& task = task_model.task;
  std::optional<OverlapJudge::Meeting> meeting;
  if (StartIsFree(task_model, task.start_offset_m, meeting)) return;
  std::string mend = "start further away or lower feeler_max_cells";
  for (double more_m = task.cell_m; more_m < 0.2; more_m *= 1.5) {
    std::optional<OverlapJudge::Meeting> other;
    const double raised_m = task.cell_m * std::ceil(more_m / task.cell_m);
    const Eigen::Vector3d start_m = task.start_offset_m - raised_m * UnitVector(task.insertion);
    if (!StartIsFree(task_model, start_m, other)) continue;
    mend += fmt::format(": \"{:.4g} {:.4g} {:.4g}\" is free", start_m.x(), start_m.y(), start_m.z());
    break;
  }
  const mjModel& model = *task_model.model;
  findings.push_back(
      {Severity::kError, "start", Numeric(where, "feeler_start_offset"),
       fmt::format("the tool starts in collision with the target under a hypothesis of the largest extents: {} and {}",
                   NameOfTaskGeom(model, meeting->tool_geom), NameOfTaskGeom(model, meeting->target_geom)),
       mend});
}

/// A geom of the target that is only seen and fills the way in: a lid by another name.
std::optional<int> LidByAnotherName(const TaskModel& task_model) {
  const mjModel& model = *task_model.model;
  for (int geom = 0; geom < model.ngeom; ++geom) {
    if (model.geom_contype[geom] != 0 || model.geom_conaffinity[geom] != 0) continue;
    int body = model.geom_bodyid[geom];
    while (body > task_model.target_body) body = model.body_parentid[body];
    if (body != task_model.target_body) continue;
    const int type = model.geom_type[geom];
    if (type == mjGEOM_PLANE || type == mjGEOM_HFIELD) continue;
    if (type == mjGEOM_MESH && ConvexShare(model, geom) < kConvexShare) continue;
    OverlapJudge judge(task_model, FeltGeoms{task_model.tool_geoms, {geom}});
    if (judge.Overlap(UnitVector(task_model.task.insertion) * (0.5 * task_model.task.insertion_depth_m))) return geom;
  }
  return std::nullopt;
}

}  // namespace

std::string NameOfTaskGeom(const mjModel& model, int geom) {
  const char* name = mj_id2name(&model, mjOBJ_GEOM, geom);
  const char* body = mj_id2name(&model, mjOBJ_BODY, model.geom_bodyid[geom]);
  const std::string of = fmt::format(" of {}", body == nullptr ? "the world" : body);
  if (name != nullptr) return fmt::format("\"{}\"", name) + of;
  return fmt::format("geom {}", geom - model.body_geomadr[model.geom_bodyid[geom]] + 1) + of;
}

TaskFindings GeometryFindings(const TaskModel& task_model, const std::string& where) {
  TaskFindings findings;
  AddMillimetres(task_model, where, findings);
  if (!findings.empty()) return findings;  // all else would follow from it
  AddWayIn(task_model, where, findings);
  if (findings.empty()) AddTolerance(task_model, where, findings);
  AddStart(task_model, where, findings);
  return findings;
}

TaskFindings LidFindings(const TaskModel& task_model, const std::string& where) {
  TaskFindings findings;
  const Task& task = task_model.task;
  const char* why =
      "policies would count on the tool falling into the opening, which most true positions between the "
      "lattice points do not do";
  if (task_model.lid_geoms.empty() && task_model.tool_lid_geoms.empty()) {
    if (const auto geom = LidByAnotherName(task_model)) {
      findings.push_back({Severity::kError, "lid", Geom(where, *task_model.model, *geom),
                          fmt::format("fills the opening, is only seen and is not named lid: {}", why),
                          "let its name begin with \"lid\""});
      return findings;
    }
    findings.push_back(
        {Severity::kError, "lid", fmt::format("{}: <body name=\"target\">", where),
         fmt::format("no lid closes the opening: {}", why),
         "add a geom named lid that fills the opening, contype=\"0\" conaffinity=\"0\" mass=\"0\", or plan "
         "with --opening open"});
    return findings;
  }
  OverlapJudge closed(task_model, GeomsOf(task_model, Opening::kClosed));
  if (BlockedAt(closed, task, Eigen::Vector3d::Zero())) return findings;
  const int geom = task_model.lid_geoms.empty() ? task_model.tool_lid_geoms.front() : task_model.lid_geoms.front();
  findings.push_back({Severity::kError, "lid", Geom(where, *task_model.model, geom),
                      fmt::format("leaves the way in free, over all of the {:.4g} m of the insertion: {}",
                                  task.insertion_depth_m, why),
                      "let the lid fill the opening from its floor to the rim"});
  return findings;
}

}  // namespace feeler::env
