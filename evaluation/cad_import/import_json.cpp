#include "feeler/evaluation/cad_import/import_json.h"

#include <cmath>

namespace feeler::evaluation {
namespace {

/// Nanometres are what the numbers are worth.
double Tidy(double value) { return std::round(value * 1e9) / 1e9 + 0.0; }

nlohmann::json Vector(const Eigen::Vector3d& v) { return {Tidy(v.x()), Tidy(v.y()), Tidy(v.z())}; }
nlohmann::json Vector2(const Eigen::Vector2d& v) { return {Tidy(v.x()), Tidy(v.y())}; }

nlohmann::json PoseJson(const Pose& pose) {
  Eigen::Quaterniond q(pose.linear());
  if (q.w() < 0) q.coeffs() *= -1;
  return {{"position_m", Vector(pose.translation())},
          {"quaternion_wxyz", {Tidy(q.w()), Tidy(q.x()), Tidy(q.y()), Tidy(q.z())}}};
}

nlohmann::json DeviationJson(const cad::Deviation& d) {
  return {{"added_m", Tidy(d.added_m)},
          {"added_at_m", Vector(d.added_at)},
          {"lost_m", Tidy(d.lost_m)},
          {"lost_at_m", Vector(d.lost_at)},
          {"largest_m", Tidy(d.largest_m())}};
}

nlohmann::json PartJson(const ImportedPart& part, const Pose& frame_T_cad) {
  const cad::Box box = cad::BoundsOf(part.checked.mesh);
  return {{"file", part.file},
          {"body", part.body},
          {"hash", part.hash},
          {"format", part.format},
          {"unit", part.unit},
          {"unit_reason", part.unit_reason},
          {"triangles", part.checked.mesh.size()},
          {"solids", part.checked.solids.size()},
          {"volume_m3", cad::VolumeOf(part.checked.mesh)},
          {"size_m", Vector(box.sizes())},
          {"mended", part.checked.mended},
          {"noted", part.checked.noted},
          {"frame_T_cad", PoseJson(frame_T_cad)},
          {"pieces", part.pieces.size()},
          {"tolerance_mating_m", Tidy(part.tolerance_near_m)},
          {"tolerance_elsewhere_m", Tidy(part.tolerance_far_m)},
          {"deviation",
           {{"mating", DeviationJson(part.mating)},
            {"anywhere", DeviationJson(part.anywhere)},
            {"sampled", DeviationJson(part.sampled)}}}};
}

nlohmann::json ProfileJson(const std::vector<cad::Play>& profile) {
  nlohmann::json json = nlohmann::json::array();
  for (const cad::Play& play : profile)
    json.push_back({{"depth_m", Tidy(play.depth_m)}, {"half_play_m", Vector2(play.half_m)}});
  return json;
}

}  // namespace

nlohmann::json ImportJson(const ImportOptions& options, const ImportedTask& task) {
  const cad::Mating& mating = task.mating;
  nlohmann::json numbers = nlohmann::json::object();
  for (const cad::TaskNumber& number : task.content.numbers.fields) {
    numbers[number.field] = {{"value", number.value}, {"reason", number.reason}};
  }
  nlohmann::json walls;
  for (int axis = 0; axis < 3; ++axis) {
    nlohmann::json along = nlohmann::json::array();
    for (const double wall : task.walls[static_cast<std::size_t>(axis)]) along.push_back(Tidy(wall));
    walls[axis == 0 ? "x" : axis == 1 ? "y" : "z"] = along;
  }
  return {{"format", "feeler-import"},
          {"version", 1},
          {"tool", PartJson(task.tool, mating.frame_T_tool)},
          {"target", PartJson(task.target, mating.frame_T_target)},
          {"mating",
           {{"opening_in", mating.tool_has_opening ? "tool" : "target"},
            {"depth_m", Tidy(mating.depth_m)},
            {"through", mating.through},
            {"clearance_m", Vector2(mating.clearance_m)},
            {"clearance_pieces_m", Vector2(task.pieces_clearance_m)},
            {"lead_in_m", Vector2(mating.lead_in_m)},
            {"mouth_play_m", Vector2(mating.mouth_play_m)},
            {"round", mating.round},
            {"turns_that_fit_deg", mating.turns_deg},
            {"openings", mating.openings.size()},
            {"profile", ProfileJson(mating.profile)},
            {"profile_pieces", ProfileJson(task.pieces_play)}}},
          {"material", options.material},
          {"uncertainty_m", Vector(options.uncertainty_m)},
          {"uncertainty_from", options.uncertainty_source.empty() ? "assumed" : options.uncertainty_source},
          {"numbers", numbers},
          {"overrides", options.overrides},
          {"walls_m", walls},
          {"margin_cells", Tidy(task.content.numbers.margin_cells)},
          {"lids", task.content.lids.size()},
          {"notes", task.notes}};
}

}  // namespace feeler::evaluation
