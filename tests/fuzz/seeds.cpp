#include <filesystem>
#include <fstream>
#include <iterator>
#include <type_traits>

#include "feeler/core/error.h"
#include "feeler/execution/remote/protocol/messages.h"
#include "feeler/perception/depth_file.h"
#include "feeler/perception/uncertainty_table.h"
#include "feeler/planner/belief/lattice_problem.h"
#include "feeler/planner/contact/contact_map_file.h"
#include "feeler/planner/pomdp/files/alpha_file.h"
#include "feeler/planner/pomdp/files/pomdp_file.h"
#include "feeler/planner/pomdp/search/solve_pomdp.h"
#include "feeler/planner/solve.h"
#include "feeler/policies/io/controller_json.h"
#include "feeler/policies/io/lattice_problem_file.h"
#include "feeler/policies/io/policy_blob.h"
#include "feeler/policies/io/policy_json.h"
#include "tests/fuzz/readers.h"
#include "tests/planner/pomdp/rover.h"

namespace feeler::fuzz {
namespace {

std::vector<std::string> ProblemFiles() {
  std::vector<std::string> texts;
  for (const auto& entry : std::filesystem::directory_iterator(FEELER_SOURCE_DIR "/tests/data")) {
    if (entry.path().extension() != ".json" || entry.file_size() > 20'000) continue;
    std::ifstream in(entry.path(), std::ios::binary);
    texts.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
  }
  return texts;
}

/// A policy as file or as blob.
std::vector<std::string> Policies(bool blob) {
  const planner::Problem problem =
      planner::MakeLatticeProblem(policies::ReadLatticeProblem(FEELER_SOURCE_DIR "/tests/data/slot2d.json"));
  const auto result = planner::Solve(problem, planner::FastSetting(planner::SolverKind::kCertified, 1.0));
  if (blob) return {policies::EncodePolicyBlob(*result.policy)};
  return {policies::FormatPolicyFile(policies::ToPolicyFile(problem, *result.policy, "slot"))};
}

std::vector<std::string> Clouds() {
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
  const std::string pcd =
      "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 3\nHEIGHT 1\n"
      "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 3\n";
  const std::string points = "0.1 0.2 0.3\n0.4 0.5 0.6\n0.7 0.8 0.9\n";
  std::string binary_ply = ply + "end_header\n" + std::string(36, '\x3e');
  binary_ply.replace(binary_ply.find("ascii"), 5, "binary_little_endian");
  return {ply + "end_header\n" + points, binary_ply,
          ply + "element face 1\nproperty list uchar int vertex_indices\nend_header\n" + points + "3 0 1 2\n",
          pcd + "DATA ascii\n" + points, pcd + "DATA binary\n" + std::string(36, '\x3e')};
}

std::vector<std::string> DepthImages() {
  perception::DepthFrame frame{64, 48, std::vector<float>(std::size_t{64} * 48, 0.7F)};
  for (std::size_t i = 0; i < frame.depth_m.size(); ++i) frame.depth_m[i] += 1e-4F * static_cast<float>(i % 97);
  return {perception::EncodeDepthPng(frame, 1e-3)};
}

std::string Table() {
  perception::UncertaintyTable table;
  table.task = "plug";
  table.fingerprint = "0";
  table.axes = {{AxisKind::kX, 0.002, 2, 15}, {AxisKind::kY, 0.002, 2, 15}};
  table.camera_m = {0.1, 0.2, 0.9};
  table.averaged_frames = 10;
  for (const double nearest : {0.5, 0.8}) {
    table.rules.push_back({nearest,
                           nearest + 0.3,
                           {0.001, -0.002, 0.0},
                           Eigen::Vector2d(0.004, 0.006),
                           Eigen::Vector2d(0.002, 0.003),
                           40});
  }
  table.plain_rules = table.rules;
  return perception::ToJson(table);
}

/// Policies of the tiger: "controller", "alpha" or "policyx".
std::string TigerPolicy(std::string_view form) {
  const planner::Pomdp tiger = planner::ParseCassandraPomdp(TigerText(), "tiger");
  planner::PomdpSolverOptions options;
  options.kind = planner::PomdpSolverKind::kPointBased;
  options.expansion_limit = 200;
  planner::PomdpResult result = planner::SolvePomdp(tiger, options);
  constexpr std::size_t kVectors = 8;  // mutations are to hit more than numbers
  if (result.alphas.size() > kVectors) result.alphas.resize(kVectors);
  if (form == "controller") return policies::FormatController(tiger, *result.controller, result.value_lower);
  return form == "alpha" ? planner::FormatAlpha(tiger, result.alphas) : planner::FormatPolicyx(tiger, result.alphas);
}

std::string SmallContactMap() {
  const CellBox box{{-1, -1, 0}, {1, 1, 2}};
  planner::ContactMap::Layer layer;
  layer.blocked.assign(static_cast<std::size_t>(box.Count()), 0);
  for (std::vector<float>& travel : layer.travel) travel.assign(layer.blocked.size(), 2.5F);
  return planner::EncodeContactMap(planner::ContactMap(box, {layer}, {0.1, 0.2, 0.3}, 0.4));
}

std::vector<std::string> WireMessages(bool requests) {
  std::vector<std::string> lines;
  for (const auto form : {execution::WireForm::kJson, execution::WireForm::kNumbers}) {
    const auto add = [&](const auto& message) {
      try {
        if constexpr (std::is_convertible_v<decltype(message), execution::Request>) {
          lines.push_back(execution::EncodeRequest(form, lines.size() + 1, message));
        } else {
          lines.push_back(execution::EncodeReply(form, lines.size() + 1, message));
        }
      } catch (const Error&) {  // NOLINT(bugprone-empty-catch): numbers alone cannot say all
      }
    };
    if (requests) {
      add(execution::HelloRequest{});
      add(execution::TransferRequest{});
      add(execution::LinearRequest{});
      add(execution::EpisodeRequest{});
      add(execution::StopRequest{});
    } else {
      add(execution::WelcomeReply{});
      add(execution::StateReply{});
      add(execution::ContactReply{});
      add(execution::EpisodeReply{});
      add(execution::VerdictReply{});
    }
  }
  return lines;
}

}  // namespace

std::vector<std::string> Seeds(const Reader& reader) {
  const std::string_view name = reader.name;
  if (name == "policy_file") return Policies(false);
  if (name == "policy_blob") return Policies(true);
  if (name == "family") return {"2..15x2..15x2..15", "3x4x5", "2..3x7x2..2"};
  if (name == "cloud") return Clouds();
  if (name == "depth") return DepthImages();
  if (name == "intrinsics") return {perception::ToJson(perception::CameraIntrinsics{640, 480, 600, 600, 320, 240})};
  if (name == "table") return {Table()};
  if (name == "pomdp") return {TigerText()};
  if (name == "pomdpx") {
    return {planner::Rover(planner::kTableTransitions, planner::kTableSensor),
            planner::Rover(planner::kDiagramTransitions, planner::kDiagramSensor)};
  }
  if (name == "controller" || name == "alpha" || name == "policyx") return {TigerPolicy(name)};
  if (name == "contact_map") return {SmallContactMap()};
  if (name == "wire_request" || name == "wire_reply") return WireMessages(name == "wire_request");
  return ProblemFiles();
}

}  // namespace feeler::fuzz
