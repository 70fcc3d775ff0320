#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "feeler/cad/folder/task_folder.h"
#include "feeler/cad/measure/deviation.h"
#include "feeler/cad/measure/mating.h"
#include "feeler/cad/mesh/mesh_check.h"
#include "feeler/core/pose.h"
#include "feeler/env/model/task_file.h"
#include "feeler/env/model/task_finding.h"

namespace feeler::evaluation {

/// What `feeler task import` is asked for.
struct ImportOptions {
  std::string tool;  ///< a file, or a body of one: "part.step#2"
  std::string target;
  std::filesystem::path out;
  std::string unit;                  ///< empty: what the files say, or a guess by size
  bool aligned = false;              ///< the parts stand as assembled in their CAD frames
  std::optional<Pose> frame_T_tool;  ///< poses of the CAD frames, assembled, in one frame
  std::optional<Pose> frame_T_target;
  std::optional<Eigen::Vector3d> mouth_m;  ///< in CAD coordinates of the target
  Eigen::Vector3d uncertainty_m{0.005, 0.005, 0.005};
  std::string uncertainty_source;  ///< where that is known from, a half sentence; empty: it is assumed
  std::string material = "abs";
  std::map<std::string, std::string> overrides;      ///< feeler_... -> value; kept from an earlier import
  double deviation_share = 0.1;                      ///< of the clearance, that pieces may deviate by where parts mate
  std::function<void(const std::string&)> on_stage;  ///< what is done now, for people
};

/// One of the two parts.
struct ImportedPart {
  std::string file;  ///< name, without its folder
  std::string body;
  std::string hash;  ///< of the file's bytes
  std::string format;
  std::string unit;
  std::string unit_reason;
  cad::CheckedPart checked;              ///< in its CAD frame, metres
  cad::TriangleMesh placed;              ///< in the frame of tool or target
  std::vector<cad::ConvexPiece> pieces;  ///< in that frame
  double tolerance_near_m = 0.0;         ///< with which the pieces were made
  double tolerance_far_m = 0.0;
  cad::Deviation anywhere;
  cad::Deviation mating;
  cad::Deviation sampled;  ///< 100,000 points, anywhere
};

/// What an import found and wrote.
struct ImportedTask {
  ImportedPart tool;
  ImportedPart target;
  cad::Mating mating;
  std::vector<cad::Play> pieces_play;  ///< of the pieces, at the depths of the profile
  Eigen::Vector2d pieces_clearance_m = Eigen::Vector2d::Zero();
  cad::TaskContent content;
  cad::Walls walls;
  std::vector<std::string> notes;  ///< choices and warnings, a sentence each
  env::TaskFindings findings;      ///< of CheckTask, where it was asked; not in `json`
  nlohmann::json json;             ///< import.json
  std::filesystem::path task_file;
  bool flush_x = false;  ///< no side across x can be felt from outside
  bool flush_y = false;
};

/// From two CAD files to a task folder: reads, checks, aligns, measures, cuts into convex pieces, derives the numbers
/// and writes task.xml, meshes and import.json; each result is measured against the input. Same input, same bytes.
/// Throws InputError with what is wrong, and where.
ImportedTask ImportTask(const ImportOptions& options);

}  // namespace feeler::evaluation
