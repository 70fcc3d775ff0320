#include "feeler/env/model/task_xml.h"

#include <tinyxml2.h>

#include <cstring>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>

#include "feeler/core/error.h"

namespace feeler::env {
namespace {

namespace fs = std::filesystem;

void Parse(const std::string& text, const std::string& name, tinyxml2::XMLDocument& document) {
  document.Parse(text.c_str(), text.size());
  if (document.Error()) {
    throw InputError(name, "malformed XML in line " + std::to_string(document.ErrorLineNum()) + ": " +
                               tinyxml2::XMLDocument::ErrorIDToName(document.ErrorID()));
  }
  if (document.RootElement() == nullptr) throw InputError(name, "the file is empty");
}

class Includer {
 public:
  Includer(fs::path folder, tinyxml2::XMLDocument& document) : folder_(std::move(folder)), document_(document) {}

  void Resolve(tinyxml2::XMLElement& parent, const std::string& name) {
    tinyxml2::XMLElement* child = parent.FirstChildElement();
    while (child != nullptr) {
      tinyxml2::XMLElement* next = child->NextSiblingElement();
      if (std::strcmp(child->Name(), "include") == 0) {
        Splice(parent, *child, name);
      } else {
        Resolve(*child, name);
      }
      child = next;
    }
  }

 private:
  void Splice(tinyxml2::XMLElement& parent, tinyxml2::XMLElement& include, const std::string& name) {
    const char* attribute = include.Attribute("file");
    const std::string where = name + ": <include> in line " + std::to_string(include.GetLineNum());
    if (attribute == nullptr) throw InputError(where, "attribute file is missing");
    const fs::path file = (fs::path(attribute).is_absolute() ? fs::path(attribute) : folder_ / attribute);
    if (!included_.insert(fs::weakly_canonical(file).string()).second) {
      throw InputError(where, "file " + std::string(attribute) + " is included twice", "MJCF allows it once");
    }
    if (!fs::is_regular_file(file)) throw InputError(where, "no file " + file.lexically_normal().string());
    tinyxml2::XMLDocument part;
    const std::string part_name = file.lexically_normal().string();
    Parse(ReadTextFile(file), part_name, part);
    Resolve(*part.RootElement(), part_name);
    tinyxml2::XMLNode* last = &include;
    for (tinyxml2::XMLNode* node = part.RootElement()->FirstChild(); node != nullptr; node = node->NextSibling()) {
      last = parent.InsertAfterChild(last, node->DeepClone(&document_));
    }
    parent.DeleteChild(&include);
  }

  fs::path folder_;
  tinyxml2::XMLDocument& document_;
  std::set<std::string> included_;
};

/// MuJoCo looks for meshes and height fields in meshdir, for textures in texturedir, both relative to the main file.
void MakeAssetFilesAbsolute(tinyxml2::XMLElement& root, const fs::path& folder) {
  fs::path mesh_folder = folder;
  fs::path texture_folder = folder;
  for (auto* compiler = root.FirstChildElement("compiler"); compiler != nullptr;
       compiler = compiler->NextSiblingElement("compiler")) {
    if (const char* directory = compiler->Attribute("meshdir")) mesh_folder = folder / directory;
    if (const char* directory = compiler->Attribute("texturedir")) texture_folder = folder / directory;
    compiler->DeleteAttribute("meshdir");
    compiler->DeleteAttribute("texturedir");
  }
  for (auto* assets = root.FirstChildElement("asset"); assets != nullptr;
       assets = assets->NextSiblingElement("asset")) {
    for (auto* asset = assets->FirstChildElement(); asset != nullptr; asset = asset->NextSiblingElement()) {
      const bool texture = std::strcmp(asset->Name(), "texture") == 0;
      for (const char* key : {"file", "fileright", "fileleft", "fileup", "filedown", "filefront", "fileback"}) {
        const char* file = asset->Attribute(key);
        if (file == nullptr) continue;
        asset->SetAttribute(key, ((texture ? texture_folder : mesh_folder) / file).lexically_normal().c_str());
      }
    }
  }
}

}  // namespace

std::string ReadTextFile(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in || fs::is_directory(file)) throw InputError(file.string(), "cannot be read");
  std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  if (in.bad()) throw InputError(file.string(), "cannot be read");
  return text;
}

std::string ResolveMjcf(const std::string& mjcf, const std::string& name, const fs::path& folder) {
  tinyxml2::XMLDocument document;
  Parse(mjcf, name, document);
  tinyxml2::XMLElement& root = *document.RootElement();
  if (std::strcmp(root.Name(), "mujoco") != 0) {
    throw InputError(name, "the root element is <" + std::string(root.Name()) + ">",
                     "a task file is MJCF: <mujoco> ... </mujoco>");
  }
  const fs::path absolute = fs::absolute(folder).lexically_normal();
  Includer(absolute, document).Resolve(root, name);
  MakeAssetFilesAbsolute(root, absolute);
  tinyxml2::XMLPrinter printer;
  document.Print(&printer);
  return printer.CStr();
}

}  // namespace feeler::env
