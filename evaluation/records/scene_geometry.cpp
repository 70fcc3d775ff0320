#include "feeler/evaluation/records/scene_geometry.h"

#include <cmath>
#include <string>

#include "feeler/core/file_output.h"

namespace feeler::evaluation {
namespace {

using nlohmann::ordered_json;

/// Numbers to a micrometre: a page holds many of them.
ordered_json Rounded(const mjtNum* values, int count) {
  ordered_json json = ordered_json::array();
  for (int i = 0; i < count; ++i) json.push_back(std::round(values[i] * 1e6) / 1e6);
  return json;
}

const char* TypeName(int type) {
  switch (type) {
    case mjGEOM_PLANE: return "plane";
    case mjGEOM_SPHERE: return "sphere";
    case mjGEOM_CAPSULE: return "capsule";
    case mjGEOM_ELLIPSOID: return "ellipsoid";
    case mjGEOM_CYLINDER: return "cylinder";
    case mjGEOM_BOX: return "box";
    case mjGEOM_MESH: return "mesh";
    default: return nullptr;
  }
}

/// What a body, or the one that carries it, belongs to.
const char* PartOf(const env::Scene& scene, const mjModel& model, int body) {
  for (int b = body; b > 0; b = model.body_parentid[b]) {
    if (b == scene.tool_body) return "tool";
    if (b == scene.target_body) return "target";
    for (const int joint : scene.joint) {
      if (model.jnt_bodyid[joint] == b) return "robot";
    }
  }
  return "environment";
}

ordered_json BodyJson(const env::Scene& scene, const mjModel& model, int body) {
  ordered_json json = {{"parent", model.body_parentid[body]},
                       {"position_m", Rounded(model.body_pos + 3 * body, 3)},
                       {"quaternion_wxyz", Rounded(model.body_quat + 4 * body, 4)}};
  for (int i = 0; i < env::kJointCount; ++i) {
    const int joint = scene.joint[static_cast<std::size_t>(i)];
    if (model.jnt_bodyid[joint] != body) continue;
    json["joint"] = i;
    json["axis"] = Rounded(model.jnt_axis + 3 * joint, 3);
  }
  return json;
}

ordered_json MeshJson(const mjModel& model, int mesh) {
  ordered_json vertices = ordered_json::array();
  for (int i = 3 * model.mesh_vertadr[mesh]; i < 3 * (model.mesh_vertadr[mesh] + model.mesh_vertnum[mesh]); ++i) {
    vertices.push_back(std::round(static_cast<double>(model.mesh_vert[i]) * 1e6) / 1e6);
  }
  ordered_json faces = ordered_json::array();
  for (int i = 3 * model.mesh_faceadr[mesh]; i < 3 * (model.mesh_faceadr[mesh] + model.mesh_facenum[mesh]); ++i) {
    faces.push_back(model.mesh_face[i]);
  }
  return {{"vertices_m", std::move(vertices)}, {"faces", std::move(faces)}};
}

}  // namespace

ordered_json SceneJson(const env::Scene& scene) {
  const mjModel& model = *scene.drawn_model;
  ordered_json json;
  json["task"] = scene.task.name;
  json["cell_m"] = scene.task.cell_m;
  json["insertion"] = ToString(scene.task.insertion);
  json["insertion_depth_m"] = scene.task.insertion_depth_m;
  json["target_body"] = scene.target_body;
  json["tool_body"] = scene.tool_body;
  json["bodies"] = ordered_json::array();
  for (int body = 0; body < model.nbody; ++body) json["bodies"].push_back(BodyJson(scene, model, body));
  json["geoms"] = ordered_json::array();
  std::vector<int> mesh_number(static_cast<std::size_t>(model.nmesh), -1);
  ordered_json meshes = ordered_json::array();
  for (int geom = 0; geom < model.ngeom; ++geom) {
    const char* type = TypeName(model.geom_type[geom]);
    const int material = model.geom_matid[geom];
    const float* color = material >= 0 ? model.mat_rgba + 4 * material : model.geom_rgba + 4 * geom;
    if (type == nullptr || model.geom_group[geom] >= env::Scene::kCollisionGroup || color[3] == 0.0F) continue;
    ordered_json entry = {{"body", model.geom_bodyid[geom]},
                          {"part", PartOf(scene, model, model.geom_bodyid[geom])},
                          {"type", type},
                          {"position_m", Rounded(model.geom_pos + 3 * geom, 3)},
                          {"quaternion_wxyz", Rounded(model.geom_quat + 4 * geom, 4)}};
    if (model.geom_type[geom] == mjGEOM_MESH) {
      const int mesh = model.geom_dataid[geom];
      int& number = mesh_number[static_cast<std::size_t>(mesh)];
      if (number < 0) {
        number = static_cast<int>(meshes.size());
        meshes.push_back(MeshJson(model, mesh));
      }
      entry["mesh"] = number;
    } else {
      entry["size_m"] = Rounded(model.geom_size + 3 * geom, 3);
    }
    ordered_json rgba = ordered_json::array();
    for (int i = 0; i < 4; ++i) rgba.push_back(std::round(1e3 * static_cast<double>(color[i])) / 1e3);
    entry["rgba"] = std::move(rgba);
    json["geoms"].push_back(std::move(entry));
  }
  json["meshes"] = std::move(meshes);
  return json;
}

std::string SceneFile(const std::string& folder, const std::string& task) {
  return (folder.empty() ? "." : folder) + "/" + task + ".scene.json";
}

void WriteSceneFile(const env::Scene& scene, const std::string& folder) {
  WriteFileAtomically(SceneFile(folder, scene.task.name), SceneJson(scene).dump() + "\n");
}

}  // namespace feeler::evaluation
