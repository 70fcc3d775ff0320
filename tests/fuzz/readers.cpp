#include "tests/fuzz/readers.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "feeler/core/error.h"
#include "feeler/execution/remote/protocol/messages.h"
#include "feeler/perception/cloud_file.h"
#include "feeler/perception/depth_file.h"
#include "feeler/perception/uncertainty_table.h"
#include "feeler/planner/belief/lattice_problem.h"
#include "feeler/planner/contact/contact_map_file.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/planner/pomdp/files/alpha_file.h"
#include "feeler/planner/pomdp/files/pomdp_file.h"
#include "feeler/policies/io/controller_json.h"
#include "feeler/policies/io/json_input.h"
#include "feeler/policies/io/lattice_problem_file.h"
#include "feeler/policies/io/policy_blob.h"
#include "feeler/policies/io/policy_json.h"

namespace feeler::fuzz {
namespace {

const std::string kWhere = "input";

Task ThreeAxes() {
  Task task;
  task.axes = {{AxisKind::kX, 0.002, 1, 15}, {AxisKind::kY, 0.002, 1, 15}, {AxisKind::kZ, 0.002, 1, 15}};
  return task;
}

void Depth(std::string_view bytes) {
  perception::CameraIntrinsics camera;
  camera.width = 64;
  camera.height = 48;
  perception::ParseDepthPng(bytes, camera, kWhere);
}

/// A tiger behind one of two doors: what controllers and alpha vectors are read for.
const planner::Pomdp& Tiger() {
  static const planner::Pomdp kTiger = planner::ParseCassandraPomdp(TigerText(), kWhere);
  return kTiger;
}

execution::WireForm FormOf(std::string_view line) {
  return execution::FormOf(line).value_or(execution::WireForm::kJson);
}

constexpr std::array kReaders{
    Reader{"lattice_problem", [](std::string_view b) { policies::ParseLatticeProblem(b, kWhere); }},
    Reader{"policy_file", [](std::string_view b) { policies::ParsePolicyFile(b, kWhere); }},
    Reader{"policy_blob", [](std::string_view b) { policies::DecodePolicyBlob(b, kWhere); }},
    Reader{"family", [](std::string_view b) { planner::ParseProblemFamily(std::string(b), ThreeAxes()); }},
    Reader{"json", [](std::string_view b) { policies::ParseJson(b, kWhere); }},
    Reader{"cloud", [](std::string_view b) { perception::ParseCloud(b, kWhere); }},
    Reader{"depth", Depth},
    Reader{"intrinsics", [](std::string_view b) { perception::ParseIntrinsics(b, kWhere); }},
    Reader{"table", [](std::string_view b) { perception::ParseTable(b, kWhere); }},
    Reader{"pomdp", [](std::string_view b) { planner::ParseCassandraPomdp(b, kWhere); }},
    Reader{"pomdpx", [](std::string_view b) { planner::ParsePomdpx(b, kWhere); }},
    Reader{"controller", [](std::string_view b) { policies::ParseController(b, kWhere, Tiger()); }},
    Reader{"alpha", [](std::string_view b) { planner::ParseAlpha(b, kWhere, Tiger()); }},
    Reader{"policyx", [](std::string_view b) { planner::ParsePolicyx(b, kWhere, Tiger()); }},
    Reader{"contact_map", [](std::string_view b) { planner::DecodeContactMap(b, kWhere); }},
    Reader{"wire_request", [](std::string_view b) { execution::DecodeRequest(FormOf(b), b); }},
    Reader{"wire_reply", [](std::string_view b) { execution::DecodeReply(FormOf(b), b); }}};

}  // namespace

std::span<const Reader> Readers() { return kReaders; }

std::string TigerText() {
  return "discount: 0.95\nvalues: reward\nstates: left right\nactions: listen open-left open-right\n"
         "observations: growl-left growl-right\nstart: uniform\n"
         "T: listen\nidentity\nT: open-left\nuniform\nT: open-right\nuniform\n"
         "O: listen\n0.85 0.15\n0.15 0.85\nO: open-left\nuniform\nO: open-right\nuniform\n"
         "R: listen : * : * : * -1\nR: open-left : left : * : * -100\nR: open-left : right : * : * 10\n"
         "R: open-right : left : * : * 10\nR: open-right : right : * : * -100\n";
}

bool ReadOnce(const Reader& reader, std::string_view bytes) {
  try {
    reader.read(bytes);
    return true;
  } catch (const Error& error) {
    const std::string line = error.what();
    const bool one_line = std::none_of(line.begin(), line.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; });
    const bool mends = dynamic_cast<const InputError*>(&error) == nullptr || line.ends_with(')');
    if (!one_line || !mends) throw std::logic_error("not a message: " + line);
    return false;
  }
}

}  // namespace feeler::fuzz
