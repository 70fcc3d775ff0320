#include "feeler/env/scene/scene_decor.h"

#include <initializer_list>
#include <string_view>
#include <utility>

namespace feeler::env {
namespace {

using tinyxml2::XMLElement;

XMLElement& Add(XMLElement& parent, const char* tag,
                std::initializer_list<std::pair<const char*, const char*>> attributes) {
  XMLElement& element = *parent.InsertNewChildElement(tag);
  for (const auto& [name, value] : attributes) element.SetAttribute(name, value);
  return element;
}

bool HasSky(const XMLElement& mujoco) {
  for (const XMLElement* asset = mujoco.FirstChildElement("asset"); asset != nullptr;
       asset = asset->NextSiblingElement("asset")) {
    for (const XMLElement* texture = asset->FirstChildElement("texture"); texture != nullptr;
         texture = texture->NextSiblingElement("texture")) {
      if (texture->Attribute("type", "skybox") != nullptr) return true;
    }
  }
  return false;
}

struct Furniture {
  bool floor = false;
  bool bench = false;
};

Furniture FurnitureOf(const XMLElement& worldbody) {
  Furniture furniture;
  for (const XMLElement* geom = worldbody.FirstChildElement("geom"); geom != nullptr;
       geom = geom->NextSiblingElement("geom")) {
    const std::string_view name = geom->Attribute("name") != nullptr ? geom->Attribute("name") : "";
    if (geom->Attribute("type", "plane") != nullptr || name == "floor") furniture.floor = true;
    if (name == "table" || name == "workbench") furniture.bench = true;
  }
  return furniture;
}

void AddGeom(XMLElement& worldbody, const char* name, const char* pos, const char* size, const char* material,
             bool collides) {
  XMLElement& geom = Add(worldbody, "geom", {{"type", "box"}, {"pos", pos}, {"size", size}, {"material", material}});
  if (name != nullptr) geom.SetAttribute("name", name);
  geom.SetAttribute("contype", collides ? 1 : 0);
  geom.SetAttribute("conaffinity", collides ? 1 : 0);
  geom.SetAttribute("group", 0);
}

void AddMaterials(XMLElement& mujoco) {
  XMLElement& asset = *mujoco.InsertNewChildElement("asset");
  Add(asset, "material",
      {{"name", "gripper_body"}, {"rgba", "0.16 0.17 0.19 1"}, {"specular", "0.5"}, {"shininess", "0.6"}});
  Add(asset, "material",
      {{"name", "gripper_metal"}, {"rgba", "0.62 0.64 0.67 1"}, {"specular", "0.8"}, {"shininess", "0.8"}});
  Add(asset, "material",
      {{"name", "gripper_pad"}, {"rgba", "0.07 0.07 0.08 1"}, {"specular", "0.1"}, {"shininess", "0.1"}});
  Add(asset, "material",
      {{"name", "bench_top"}, {"rgba", "0.55 0.50 0.44 1"}, {"specular", "0.15"}, {"shininess", "0.2"}});
  Add(asset, "material",
      {{"name", "bench_frame"}, {"rgba", "0.30 0.32 0.35 1"}, {"specular", "0.4"}, {"shininess", "0.4"}});
  Add(asset, "texture",
      {{"name", "floor_tiles"},
       {"type", "2d"},
       {"builtin", "checker"},
       {"rgb1", "0.62 0.64 0.66"},
       {"rgb2", "0.66 0.68 0.70"},
       {"mark", "edge"},
       {"markrgb", "0.54 0.56 0.58"},
       {"width", "256"},
       {"height", "256"}});
  Add(asset, "material",
      {{"name", "floor"},
       {"texture", "floor_tiles"},
       {"texrepeat", "2 2"},
       {"texuniform", "true"},
       {"specular", "0.1"},
       {"shininess", "0.1"}});
  if (!HasSky(mujoco)) {
    Add(asset, "texture",
        {{"name", "sky"},
         {"type", "skybox"},
         {"builtin", "gradient"},
         {"rgb1", "0.82 0.87 0.92"},
         {"rgb2", "0.45 0.52 0.60"},
         {"width", "256"},
         {"height", "1536"}});
  }
}

void AddVisual(XMLElement& mujoco) {
  XMLElement& visual = *mujoco.InsertNewChildElement("visual");
  Add(visual, "global", {{"offwidth", "1920"}, {"offheight", "1200"}});
  Add(visual, "headlight", {{"ambient", "0.34 0.34 0.34"}, {"diffuse", "0.32 0.32 0.32"}, {"specular", "0.1 0.1 0.1"}});
  Add(visual, "quality", {{"shadowsize", "2048"}, {"offsamples", "4"}});
  Add(visual, "map", {{"znear", "0.01"}, {"zfar", "40"}});

  // The region that shadows cover and the unit of the near and far planes.
  Add(mujoco, "statistic", {{"center", "0.45 0 0.3"}, {"extent", "1"}});
}

void AddLights(XMLElement& worldbody) {
  if (worldbody.FirstChildElement("light") == nullptr) {
    Add(worldbody, "light",
        {{"name", "key"},
         {"pos", "0.2 -0.8 1.8"},
         {"dir", "0.25 0.40 -0.88"},
         {"directional", "true"},
         {"diffuse", "0.55 0.55 0.55"},
         {"specular", "0.2 0.2 0.2"},
         {"castshadow", "true"}});
  }
  Add(worldbody, "light",
      {{"name", "fill"},
       {"pos", "1.6 1.2 1.6"},
       {"dir", "-0.6 -0.5 -0.6"},
       {"directional", "true"},
       {"diffuse", "0.20 0.21 0.23"},
       {"specular", "0.05 0.05 0.05"},
       {"castshadow", "false"}});
}

}  // namespace

void AddDecor(bool workbench, XMLElement& mujoco) {
  AddMaterials(mujoco);
  AddVisual(mujoco);
  XMLElement& worldbody = *mujoco.FirstChildElement("worldbody");
  const Furniture furniture = FurnitureOf(worldbody);
  AddLights(worldbody);
  if (!furniture.floor) {
    XMLElement& floor = Add(worldbody, "geom", {{"type", "plane"}, {"size", "4 4 0.1"}, {"material", "floor"}});
    floor.SetAttribute("name", "ground");
    floor.SetAttribute("pos", "0.4 0 -0.82");
    floor.SetAttribute("contype", 0);
    floor.SetAttribute("conaffinity", 0);
    floor.SetAttribute("group", 0);
    for (const char* leg : {"-0.26 -0.56 -0.43", "-0.26 0.56 -0.43", "1.16 -0.56 -0.43", "1.16 0.56 -0.43"}) {
      AddGeom(worldbody, nullptr, leg, "0.03 0.03 0.39", "bench_frame", false);
    }
  }
  if (workbench && !furniture.bench) {
    AddGeom(worldbody, "workbench", "0.45 0 -0.02", "0.75 0.6 0.02", "bench_top", true);
  }
}

}  // namespace feeler::env
