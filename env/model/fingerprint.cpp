#include "feeler/env/model/fingerprint.h"

#define XXH_INLINE_ALL
#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "feeler/env/model/geom_shapes.h"

namespace feeler::env {
namespace {

/// Changes when contact maps are built otherwise from the same task.
constexpr std::int64_t kBuilderVersion = 1;

/// A sequence of whole numbers to be hashed; real numbers count in units of 1e-9.
class Digest {
 public:
  void Add(std::int64_t value) {
    for (int byte = 0; byte < 8; ++byte) {
      bytes_.push_back(static_cast<std::uint8_t>(static_cast<std::uint64_t>(value) >> (8 * byte)));
    }
  }
  void AddReal(double value) { Add(std::llround(value * 1e9)); }
  void AddVector(const Eigen::Vector3d& v) {
    for (const double value : v) AddReal(value);
  }
  void AddCell(const Cell& c) {
    for (const int value : c) Add(value);
  }
  void Append(const std::vector<std::uint8_t>& bytes) { bytes_.insert(bytes_.end(), bytes.begin(), bytes.end()); }
  const std::vector<std::uint8_t>& bytes() const { return bytes_; }
  std::string Hex() const {
    const XXH128_hash_t hash = XXH3_128bits(bytes_.data(), bytes_.size());
    return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
  }

 private:
  std::vector<std::uint8_t> bytes_;
};

std::vector<std::uint8_t> GeomBytes(const mjModel& model, int geom, int body) {
  Digest digest;
  const Pose pose = GeomInBody(model, geom, body);
  digest.Add(model.geom_type[geom]);
  if (model.geom_type[geom] == mjGEOM_MESH) {
    // Where MuJoCo puts a mesh's own frame is of no matter: vertices in the frame of the body, in an order of their
    // own.
    std::vector<std::vector<std::int64_t>> vertices;
    for (const Eigen::Vector3d& vertex : MeshHull(model, geom)) {
      std::vector<std::int64_t> rounded;
      for (const double value : pose* vertex) rounded.push_back(std::llround(value * 1e9));
      vertices.push_back(std::move(rounded));
    }
    std::sort(vertices.begin(), vertices.end());
    digest.Add(static_cast<std::int64_t>(vertices.size()));
    for (const auto& vertex : vertices) {
      for (const std::int64_t value : vertex) digest.Add(value);
    }
    return digest.bytes();
  }
  for (int i = 0; i < 3; ++i) digest.AddReal(model.geom_size[3 * geom + i]);
  digest.AddVector(pose.translation());
  for (int column = 0; column < 3; ++column) digest.AddVector(pose.linear().col(column));
  return digest.bytes();
}

/// The order of geoms in the file is of no matter.
void AddGeoms(const mjModel& model, const std::vector<int>& geoms, int body, Digest& digest) {
  std::vector<std::vector<std::uint8_t>> all;
  for (const int geom : geoms) all.push_back(GeomBytes(model, geom, body));
  std::sort(all.begin(), all.end());
  digest.Add(static_cast<std::int64_t>(all.size()));
  for (const auto& bytes : all) digest.Append(bytes);
}

Digest ContactMapDigest(const TaskModel& task_model, Opening opening) {
  const mjModel& model = *task_model.model;
  Digest digest;
  digest.Add(kBuilderVersion);
  AddGeoms(model, task_model.tool_geoms, task_model.tool_body, digest);
  AddGeoms(model, task_model.target_geoms, task_model.target_body, digest);
  digest.Add(opening == Opening::kClosed ? 1 : 0);
  if (opening == Opening::kClosed) AddGeoms(model, task_model.lid_geoms, task_model.target_body, digest);
  if (opening == Opening::kClosed && !task_model.tool_lid_geoms.empty()) {
    AddGeoms(model, task_model.tool_lid_geoms, task_model.tool_body, digest);
  }
  digest.AddReal(task_model.task.cell_m);
  const CellBox domain = DisplacementsOf(task_model.task);
  digest.AddCell(domain.min);
  digest.AddCell(domain.max);
  for (const UncertainAxis& axis : task_model.task.axes) {
    if (!axis.angular()) continue;
    digest.Add(static_cast<int>(axis.kind));
    digest.AddReal(axis.resolution);
    digest.Add(axis.max_cells);
  }
  return digest;
}

}  // namespace

std::string ContactMapFingerprint(const TaskModel& task_model, Opening opening) {
  return ContactMapDigest(task_model, opening).Hex();
}

std::string Fingerprint(const TaskModel& task_model, Opening opening) {
  const Task& task = task_model.task;
  Digest digest = ContactMapDigest(task_model, opening);
  for (const UncertainAxis& axis : task.axes) {
    digest.Add(static_cast<int>(axis.kind));
    digest.AddReal(axis.resolution);
    digest.Add(axis.min_cells);
    digest.Add(axis.max_cells);
  }
  digest.AddVector(task.start_offset_m);
  digest.AddVector(task.workspace_m);
  if (!task.workspace_center_m.isZero()) digest.AddVector(task.workspace_center_m);
  digest.Add(static_cast<std::int64_t>(task.move_lengths.size()));
  for (const int length : task.move_lengths) digest.Add(length);
  digest.AddReal(task.cost.per_cell);
  digest.AddReal(task.cost.per_contact);
  digest.AddReal(task.cost.per_action);
  if (!task.cost.one_per_cell()) {
    for (const double beyond : task.cost.beyond_per_cell) digest.AddReal(beyond);
  }
  digest.Add(static_cast<int>(task.goal));
  digest.Add(IndexOf(task.insertion));
  digest.AddReal(task.tolerance.lateral_m);
  digest.AddReal(task.tolerance.vertical_m);
  digest.AddReal(task.tolerance.angle_rad);
  if (!task.tolerance.one_lateral()) digest.AddVector(task.tolerance.lateral_beyond_m);
  if (!task.tolerance.one_angle()) digest.AddVector(task.tolerance.angle_beyond_rad);
  return digest.Hex();
}

}  // namespace feeler::env
