#include "feeler/execution/remote/cell_file.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "feeler/core/error.h"
#include "feeler/core/file_output.h"
#include "feeler/policies/io/json_input.h"
#include "feeler/version.h"

namespace feeler::execution {
namespace {

using nlohmann::ordered_json;
using policies::JsonField;

constexpr const char* kFormat = "feeler cell";

ordered_json List(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Eigen::Vector3d VectorAt(const JsonField& field) {
  constexpr double kLeast = -1e6;
  field.ListSize(3, 3);
  return {field[std::size_t{0}].Number(kLeast), field[std::size_t{1}].Number(kLeast),
          field[std::size_t{2}].Number(kLeast)};
}

void ReadNumber(const JsonField& root, const char* key, double least, double most, std::optional<double>& value) {
  if (!root.Has(key)) return;
  value = root[key].Number(least);
  if (*value > most) root[key].Fail(fmt::format("is above {:g}", most), "measure again: no arm is so");
}

}  // namespace

CellFile ReadCellFile(const std::string& path) {
  const nlohmann::json document = policies::ParseJson(policies::ReadTextFile(path), path);
  const JsonField root(document, path);
  root.RequireKeys({"format", "version"},
                   {"created_by", "tool", "robot", "box_min_m", "box_max_m", "force_bias_n", "force_noise_n",
                    "contact_force_n", "stiffness_n_m", "reaction_time_s", "tool_offset_m", "measured"});
  if (root["format"].Text() != kFormat) root["format"].Fail("is no cell file", "feeler cell calibrate writes one");
  if (root["version"].Integer(0, 1000) != 1) root["version"].Fail("is not 1", "use the feeler that wrote it");
  CellFile cell;
  if (root.Has("tool")) cell.tool = root["tool"].Text();
  if (root.Has("robot")) cell.robot = root["robot"].Text();
  if (root.Has("box_min_m") != root.Has("box_max_m")) root.Fail("has one corner of the box", "give both, or none");
  if (root.Has("box_min_m")) {
    cell.box = WorkspaceBox{VectorAt(root["box_min_m"]), VectorAt(root["box_max_m"])};
    if (!(cell.box->min_m.array() < cell.box->max_m.array()).all()) {
      root["box_min_m"].Fail("is not below box_max_m", "give the least and the greatest corner");
    }
  }
  ReadNumber(root, "force_bias_n", 0.0, 1000.0, cell.force_bias_n);
  ReadNumber(root, "force_noise_n", 0.0, 100.0, cell.force_noise_n);
  ReadNumber(root, "contact_force_n", 0.1, 500.0, cell.contact_force_n);
  ReadNumber(root, "stiffness_n_m", 1.0, 1e8, cell.stiffness_n_m);
  ReadNumber(root, "reaction_time_s", 0.0, 1.0, cell.reaction_time_s);
  if (root.Has("tool_offset_m")) cell.tool_offset_m = VectorAt(root["tool_offset_m"]);
  constexpr double kMostOffset_m = 0.05;
  if (cell.tool_offset_m.norm() > kMostOffset_m) {
    root["tool_offset_m"].Fail("is farther than 50 mm", "teach the tool centre point to the robot first");
  }
  return cell;
}

void WriteCellFile(const std::string& path, const CellFile& cell) {
  ordered_json json = {{"format", kFormat}, {"version", 1}, {"created_by", std::string("feeler ") + FEELER_VERSION}};
  json["tool"] = cell.tool;
  json["robot"] = cell.robot;
  if (cell.box) {
    json["box_min_m"] = List(cell.box->min_m);
    json["box_max_m"] = List(cell.box->max_m);
  }
  if (cell.force_bias_n) json["force_bias_n"] = *cell.force_bias_n;
  if (cell.force_noise_n) json["force_noise_n"] = *cell.force_noise_n;
  if (cell.contact_force_n) json["contact_force_n"] = *cell.contact_force_n;
  if (cell.stiffness_n_m) json["stiffness_n_m"] = *cell.stiffness_n_m;
  if (cell.reaction_time_s) json["reaction_time_s"] = *cell.reaction_time_s;
  json["tool_offset_m"] = List(cell.tool_offset_m);
  WriteFileAtomically(path, json.dump(2) + "\n");
}

}  // namespace feeler::execution
