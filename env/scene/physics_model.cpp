#include "feeler/env/scene/physics_model.h"

#include <tinyxml2.h>

#include <Eigen/Core>
#include <string_view>
#include <utility>
#include <vector>

#include "feeler/env/model/mujoco_handles.h"

namespace feeler::env {
namespace {

using tinyxml2::XMLDocument;
using tinyxml2::XMLElement;

std::vector<XMLElement*> Children(XMLElement& parent, const char* tag) {
  std::vector<XMLElement*> children;
  for (XMLElement* child = parent.FirstChildElement(tag); child != nullptr; child = child->NextSiblingElement(tag)) {
    children.push_back(child);
  }
  return children;
}

class Pruner {
 public:
  Pruner(const mjModel& full, int lid_group) : full_(full), lid_group_(lid_group) {}

  // Bodies are numbered depth first, and the geoms of a body in the order of the text. False where that does not hold.
  bool Prune(XMLElement& body) {
    const int id = next_body_++;
    if (id >= full_.nbody) return false;
    const char* name = mj_id2name(&full_, mjOBJ_BODY, id);
    if (id > 0 && std::string_view(name == nullptr ? "" : name) !=
                      std::string_view(body.Attribute("name") == nullptr ? "" : body.Attribute("name"))) {
      return false;
    }
    const std::vector<XMLElement*> geoms = Children(body, "geom");
    if (static_cast<int>(geoms.size()) != full_.body_geomnum[id]) return false;
    bool pruned = false;
    for (std::size_t i = 0; i < geoms.size(); ++i) {
      const int geom = full_.body_geomadr[id] + static_cast<int>(i);
      const bool collides = full_.geom_contype[geom] != 0 || full_.geom_conaffinity[geom] != 0;
      if (collides || full_.geom_group[geom] == lid_group_) continue;
      body.DeleteChild(geoms[i]);
      pruned = true;
    }
    if (pruned && id > 0 && full_.body_mass[id] > 0) KeepInertia(id, body);
    for (XMLElement* camera : Children(body, "camera")) body.DeleteChild(camera);
    for (XMLElement* child : Children(body, "body")) {
      if (!Prune(*child)) return false;
    }
    return true;
  }

  bool Complete() const { return next_body_ == full_.nbody; }

 private:
  void KeepInertia(int id, XMLElement& body) {
    while (XMLElement* inertial = body.FirstChildElement("inertial")) body.DeleteChild(inertial);
    XMLElement& inertial = *body.InsertNewChildElement("inertial");
    inertial.SetAttribute("mass", MjcfVector(Eigen::Matrix<double, 1, 1>(full_.body_mass[id])).c_str());
    inertial.SetAttribute("pos", MjcfVector(Eigen::Map<const Eigen::Vector3d>(full_.body_ipos + 3 * id)).c_str());
    inertial.SetAttribute("quat", MjcfVector(Eigen::Map<const Eigen::Vector4d>(full_.body_iquat + 4 * id)).c_str());
    inertial.SetAttribute("diaginertia",
                          MjcfVector(Eigen::Map<const Eigen::Vector3d>(full_.body_inertia + 3 * id)).c_str());
  }

  const mjModel& full_;
  int lid_group_;
  int next_body_ = 0;
};

void DropTextures(XMLElement& mujoco) {
  for (XMLElement* asset : Children(mujoco, "asset")) {
    for (XMLElement* texture : Children(*asset, "texture")) asset->DeleteChild(texture);
    for (XMLElement* material : Children(*asset, "material")) material->DeleteAttribute("texture");
  }
}

bool MassesFromGeomsOnly(XMLElement& mujoco) {
  for (XMLElement* compiler : Children(mujoco, "compiler")) {
    if (compiler->Attribute("inertiafromgeom", "true") != nullptr) return true;
  }
  return false;
}

}  // namespace

std::shared_ptr<const mjModel> CompilePhysicsModel(const std::string& xml, std::shared_ptr<const mjModel> full,
                                                   int lid_group, const std::string& where) {
  XMLDocument document;
  if (full->npair > 0 || full->nsensor > 0 || full->ntendon > 0 ||
      document.Parse(xml.data(), xml.size()) != tinyxml2::XML_SUCCESS) {
    return full;
  }
  XMLElement& mujoco = *document.FirstChildElement("mujoco");
  const std::vector<XMLElement*> worlds = Children(mujoco, "worldbody");
  if (worlds.size() != 1 || MassesFromGeomsOnly(mujoco)) return full;
  Pruner pruner(*full, lid_group);
  if (!pruner.Prune(*worlds.front()) || !pruner.Complete()) return full;
  DropTextures(mujoco);
  tinyxml2::XMLPrinter printer;
  document.Print(&printer);
  return {CompileMjcf(printer.CStr(), where).release(), ModelDeleter()};
}

}  // namespace feeler::env
