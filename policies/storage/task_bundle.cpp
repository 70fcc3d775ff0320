#include "feeler/policies/storage/task_bundle.h"

#include <zlib.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string_view>

#include "feeler/core/error.h"
#include "feeler/core/file_output.h"
#include "feeler/core/json_depth.h"
#include "feeler/planner/contact/contact_map_file.h"
#include "feeler/planner/contact/exact_travel.h"
#include "feeler/policies/io/bytes.h"
#include "feeler/policies/storage/hash.h"
#include "feeler/version.h"

namespace feeler::policies {
namespace {

using nlohmann::json;
using planner::ConvexPiece;
using planner::ShapeKind;

constexpr std::string_view kBundleMagic = "FEELERBD";
constexpr std::uint32_t kBundleVersion = 1;
constexpr std::uint64_t kLargestMap = std::uint64_t{1} << 36;  // bytes
constexpr std::array<const char*, 6> kShapes = {"box", "sphere", "capsule", "cylinder", "ellipsoid", "polytope"};
constexpr std::array<AxisKind, 5> kAxes = {AxisKind::kX, AxisKind::kY, AxisKind::kZ, AxisKind::kYaw, AxisKind::kPitch};

json VectorJson(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Eigen::Vector3d VectorOf(const json& list) {
  return {list.at(0).get<double>(), list.at(1).get<double>(), list.at(2).get<double>()};
}

/// The first three rows of the matrix, row by row: bit for bit what it was.
json PoseJson(const Pose& pose) {
  json list = json::array();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) list.push_back(pose.matrix()(row, column));
  }
  return list;
}

Pose PoseOf(const json& list) {
  Pose pose = Pose::Identity();
  for (int i = 0; i < 12; ++i) pose.matrix()(i / 4, i % 4) = list.at(static_cast<std::size_t>(i)).get<double>();
  return pose;
}

json PiecesJson(const std::vector<ConvexPiece>& pieces) {
  json list = json::array();
  for (const ConvexPiece& piece : pieces) {
    json vertices = json::array();
    for (const Eigen::Vector3d& vertex : piece.vertices_m) vertices.push_back(VectorJson(vertex));
    list.push_back({{"shape", kShapes.at(static_cast<std::size_t>(piece.kind))},
                    {"size_m", VectorJson(piece.size_m)},
                    {"pose", PoseJson(piece.frame_T_piece)},
                    {"vertices_m", vertices}});
  }
  return list;
}

template <std::size_t N>
std::size_t IndexIn(const std::array<const char*, N>& names, const std::string& name) {
  for (std::size_t i = 0; i < N; ++i) {
    if (name == names[i]) return i;
  }
  throw std::out_of_range("unknown name " + name);
}

std::vector<ConvexPiece> PiecesFrom(const json& list) {
  std::vector<ConvexPiece> pieces;
  for (const json& item : list) {
    ConvexPiece piece;
    piece.kind = static_cast<ShapeKind>(IndexIn(kShapes, item.at("shape").get<std::string>()));
    piece.size_m = VectorOf(item.at("size_m"));
    piece.frame_T_piece = PoseOf(item.at("pose"));
    for (const json& vertex : item.at("vertices_m")) piece.vertices_m.push_back(VectorOf(vertex));
    pieces.push_back(std::move(piece));
  }
  return pieces;
}

json TaskJson(const Task& task) {
  json axes = json::array();
  for (const UncertainAxis& axis : task.axes) {
    axes.push_back({{"kind", ToString(axis.kind)},
                    {"resolution", axis.resolution},
                    {"min_cells", axis.min_cells},
                    {"max_cells", axis.max_cells}});
  }
  const MotionTimes& times = task.times;
  return {
      {"name", task.name},
      {"axes", axes},
      {"cell_m", task.cell_m},
      {"start_offset_m", VectorJson(task.start_offset_m)},
      {"insertion", IndexOf(task.insertion)},
      {"insertion_depth_m", task.insertion_depth_m},
      {"tolerance", {task.tolerance.lateral_m, task.tolerance.vertical_m, task.tolerance.angle_rad}},
      {"tolerance_beyond", {VectorJson(task.tolerance.lateral_beyond_m), VectorJson(task.tolerance.angle_beyond_rad)}},
      {"cost", {task.cost.per_cell, task.cost.per_contact, task.cost.per_action}},
      {"beyond_per_cell", task.cost.beyond_per_cell},
      {"force_budget_n", task.force_budget_n},
      {"times", {times.transfer_speed_m_s, times.probe_speed_m_s, times.time_per_move_s, times.time_per_contact_s}},
      {"goal", ToString(task.goal)},
      {"move_lengths", task.move_lengths},
      {"workspace_m", VectorJson(task.workspace_m)},
      {"workspace_center_m", VectorJson(task.workspace_center_m)},
      {"turns_freely", task.turns_freely},
      {"world_T_target", PoseJson(task.world_T_target)},
      {"flange_T_tool", PoseJson(task.flange_T_tool)}};
}

AxisKind AxisOfName(const std::string& name) {
  for (const AxisKind kind : kAxes) {
    if (ToString(kind) == name) return kind;
  }
  throw std::out_of_range("unknown axis " + name);
}

Task TaskFrom(const json& item) {
  Task task;
  task.name = item.at("name").get<std::string>();
  for (const json& axis : item.at("axes")) {
    task.axes.push_back({AxisOfName(axis.at("kind").get<std::string>()), axis.at("resolution").get<double>(),
                         axis.at("min_cells").get<int>(), axis.at("max_cells").get<int>()});
  }
  task.cell_m = item.at("cell_m").get<double>();
  task.start_offset_m = VectorOf(item.at("start_offset_m"));
  const int insertion = item.at("insertion").get<int>();
  if (insertion < 0 || insertion >= kDirectionCount) throw std::out_of_range("no such direction");
  task.insertion = kDirections[static_cast<std::size_t>(insertion)];
  task.insertion_depth_m = item.at("insertion_depth_m").get<double>();
  const Eigen::Vector3d tolerance = VectorOf(item.at("tolerance"));
  task.tolerance = {tolerance.x(), tolerance.y(), tolerance.z()};
  if (item.contains("tolerance_beyond")) {  // bundles of old have one for all axes
    task.tolerance.lateral_beyond_m = VectorOf(item["tolerance_beyond"].at(0));
    task.tolerance.angle_beyond_rad = VectorOf(item["tolerance_beyond"].at(1));
  }
  const Eigen::Vector3d cost = VectorOf(item.at("cost"));
  task.cost = {cost.x(), cost.y(), cost.z()};
  if (item.contains("beyond_per_cell")) {  // bundles of old have one cost per cell, and no budget
    task.cost.beyond_per_cell = item.at("beyond_per_cell").get<std::array<double, 3>>();
    task.force_budget_n = item.at("force_budget_n").get<double>();
  }
  const json& times = item.at("times");
  task.times = {times.at(0).get<double>(), times.at(1).get<double>(), times.at(2).get<double>(),
                times.at(3).get<double>()};
  const std::string goal = item.at("goal").get<std::string>();
  task.goal = goal == ToString(GoalKind::kInsertable) ? GoalKind::kInsertable : GoalKind::kSingleton;
  task.move_lengths = item.at("move_lengths").get<std::vector<int>>();
  task.workspace_m = VectorOf(item.at("workspace_m"));
  task.workspace_center_m = VectorOf(item.at("workspace_center_m"));
  task.turns_freely = item.at("turns_freely").get<bool>();
  task.world_T_target = PoseOf(item.at("world_T_target"));
  task.flange_T_tool = PoseOf(item.at("flange_T_tool"));
  return task;
}

std::string Deflated(const std::string& bytes) {
  uLongf size = compressBound(bytes.size());
  std::string packed(size, '\0');
  compress2(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(),
            Z_BEST_SPEED);
  packed.resize(size);
  return packed;
}

[[noreturn]] void FailBundle(const std::string& path, const std::string& what) {
  throw InputError(path, what, "`feeler db bundle` writes it anew");
}

std::string Inflated(std::string_view packed, std::uint64_t size, const std::string& path) {
  if (size > kLargestMap) FailBundle(path, "the bundle has an absurd size");
  std::string bytes(size, '\0');
  uLongf got = size;
  const int status = uncompress(reinterpret_cast<Bytef*>(bytes.data()), &got,
                                reinterpret_cast<const Bytef*>(packed.data()), packed.size());
  if (status != Z_OK || got != size) FailBundle(path, "the bundle is damaged (contact map)");
  return bytes;
}

}  // namespace

std::string BundlePathOf(const std::string& database) { return database + ".bundle"; }

void WriteBundle(const std::string& path, const TaskBundle& bundle) {
  const json head = {{"created_by", FEELER_VERSION},    {"fingerprint", bundle.fingerprint},
                     {"opening", bundle.opening},       {"task", TaskJson(bundle.task)},
                     {"tool", PiecesJson(bundle.tool)}, {"target", PiecesJson(bundle.target)},
                     {"lids", PiecesJson(bundle.lids)}};
  const std::string map = planner::EncodeContactMap(*bundle.map);
  ByteWriter content;
  content.Fixed32(kBundleVersion);
  content.Text(head.dump());
  content.Fixed64(map.size());
  content.Text(Deflated(map));
  std::string bytes(kBundleMagic);
  bytes += content.bytes();
  ByteWriter checksum;
  checksum.Fixed64(Hash64(bytes));
  WriteBundleFile(path, bytes + checksum.bytes());
}

void WriteBundleFile(const std::string& path, std::string_view bytes) {
  std::ifstream in(path, std::ios::binary);
  std::string head(kBundleMagic.size(), '\0');
  if (in && in.read(head.data(), 1) &&
      !(in.read(head.data() + 1, static_cast<std::streamsize>(head.size()) - 1) && head == kBundleMagic)) {
    throw InputError(path, "exists and is not the bundle of a task: it is not overwritten",
                     "move it away, or choose another name for the database");
  }
  WriteFileAtomically(path, bytes);
}

TaskBundle ReadBundle(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::error_code ignored;
  if (!in || !std::filesystem::is_regular_file(path, ignored)) FailBundle(path, "the bundle of the task is not there");
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  constexpr std::size_t kHead = kBundleMagic.size() + 4;
  const std::string_view all = bytes;
  if (all.size() < kHead + 8 || !all.starts_with(kBundleMagic)) FailBundle(path, "is no bundle of a task");
  ByteReader reader(all.substr(kBundleMagic.size(), all.size() - kBundleMagic.size() - 8));
  if (const std::uint32_t version = reader.Fixed32(); version != kBundleVersion) {
    throw InputError(path, "is a bundle of version " + std::to_string(version) + "; this feeler reads version 1",
                     "use the feeler that wrote it, or a newer one");
  }
  if (ByteReader(all.substr(all.size() - 8)).Fixed64() != Hash64(all.substr(0, all.size() - 8))) {
    FailBundle(path, "the bundle is damaged (checksum)");
  }
  const auto text = [&]() -> std::string_view {
    const std::uint64_t size = reader.Varint();
    if (reader.failed() || size > reader.remaining()) FailBundle(path, "the bundle is truncated");
    const std::string_view part = reader.rest().substr(0, size);
    reader = ByteReader(reader.rest().substr(size));
    return part;
  };
  TaskBundle bundle;
  try {
    const auto head = ParseJsonText<json>(text());
    bundle.fingerprint = head.at("fingerprint").get<std::string>();
    bundle.opening = head.at("opening").get<std::string>();
    bundle.task = TaskFrom(head.at("task"));
    bundle.task.file = path;
    bundle.tool = PiecesFrom(head.at("tool"));
    bundle.target = PiecesFrom(head.at("target"));
    bundle.lids = PiecesFrom(head.at("lids"));
  } catch (const json::exception& error) {
    FailBundle(path, std::string("the bundle is damaged: ") + error.what());
  } catch (const std::out_of_range& error) {
    FailBundle(path, std::string("the bundle is damaged: ") + error.what());
  }
  const std::uint64_t size = reader.Fixed64();
  bundle.map =
      std::make_shared<const planner::ContactMap>(planner::DecodeContactMap(Inflated(text(), size, path), path));
  return bundle;
}

TaskBundle ReadBundleOf(const Database& database) {
  TaskBundle bundle = ReadBundle(BundlePathOf(database.path()));
  database.RequireFingerprint(bundle.task.name, bundle.fingerprint);
  if (bundle.opening != database.identity().opening) {
    FailBundle(BundlePathOf(database.path()),
               "was made with the opening " + bundle.opening + ", the database with it " + database.identity().opening);
  }
  return bundle;
}

std::unique_ptr<planner::TravelModel> TravelModelOf(const TaskBundle& bundle) {
  return std::make_unique<planner::ExactTravel>(bundle.tool, bundle.target);
}

}  // namespace feeler::policies
