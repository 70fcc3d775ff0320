#include "feeler/env/model/task_xml.h"

#include <tinyxml2.h>

#include <array>
#include <cstring>
#include <fstream>
#include <set>
#include <sstream>
#include <system_error>
#include <vector>

#include "feeler/core/error.h"
#include "feeler/env/mjcf/mjcf_numbers.h"

namespace feeler::env {
namespace {

namespace fs = std::filesystem;

void Parse(const std::string& text, const std::string& name, tinyxml2::XMLDocument& document) {
  document.Parse(text.c_str(), text.size());
  if (document.Error()) {
    throw InputError(name,
                     "malformed XML in line " + std::to_string(document.ErrorLineNum()) + ": " +
                         tinyxml2::XMLDocument::ErrorIDToName(document.ErrorID()),
                     "correct it");
  }
  if (document.RootElement() == nullptr)
    throw InputError(name, "the file is empty", "give a task file (docs/task-file.md)");
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

  const std::set<std::string>& included() const { return included_; }

 private:
  void Splice(tinyxml2::XMLElement& parent, tinyxml2::XMLElement& include, const std::string& name) {
    const char* attribute = include.Attribute("file");
    const std::string where = name + ": <include> in line " + std::to_string(include.GetLineNum());
    if (attribute == nullptr) throw InputError(where, "attribute file is missing", "name the file to include");
    const fs::path file = (fs::path(attribute).is_absolute() ? fs::path(attribute) : folder_ / attribute);
    std::error_code error;
    fs::path canonical = fs::weakly_canonical(file, error);
    if (error) throw InputError(where, file.string() + ": " + error.message(), "check the name and the permissions");
    if (!included_.insert(canonical.string()).second) {
      throw InputError(where, "file " + std::string(attribute) + " is included twice", "MJCF allows it once");
    }
    if (!fs::is_regular_file(file, error))
      throw InputError(where, "no file " + file.lexically_normal().string(), "check the name");
    tinyxml2::XMLDocument part;
    const std::string part_name = file.lexically_normal().string();
    Parse(ReadTextFile(file), part_name, part);
    RequireFiniteNumbers(*part.RootElement(), part_name);  // here, where its lines are its own
    Resolve(*part.RootElement(), part_name);
    tinyxml2::XMLNode* last = &include;
    for (tinyxml2::XMLNode* node = part.RootElement()->FirstChild(); node != nullptr; node = node->NextSibling()) {
      last = parent.InsertAfterChild(last, node->DeepClone(&document_));
    }
    parent.DeleteChild(&include);
  }

  fs::path folder_;
  tinyxml2::XMLDocument& document_;
  std::set<std::string> included_;  // canonical
};

constexpr std::array<const char*, 7> kFileAttributes{"file",     "fileright", "fileleft", "fileup",
                                                     "filedown", "filefront", "fileback"};

constexpr std::size_t kLargestFile = std::size_t{1} << 30;

/// MuJoCo reads a file to its end, and a device or a pipe may have none. What is not there it names itself.
void RequireRegularFile(const fs::path& file, const tinyxml2::XMLElement& asset, const std::string& name) {
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  if (error || !fs::exists(status)) return;
  const std::string where = name + ": <" + asset.Name() + "> in line " + std::to_string(asset.GetLineNum());
  if (!fs::is_regular_file(status)) throw InputError(where, file.string() + " is not a regular file", "give a file");
  if (fs::file_size(file, error) <= kLargestFile || error) return;
  throw InputError(where, file.string() + " is larger than " + std::to_string(kLargestFile) + " bytes",
                   "give a smaller file");
}

/// MuJoCo looks for meshes and height fields in meshdir, for textures in texturedir, both relative to the main file.
void MakeAssetFilesAbsolute(tinyxml2::XMLElement& root, const std::string& name, const fs::path& folder) {
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
      for (const char* key : kFileAttributes) {
        const char* file = asset->Attribute(key);
        if (file == nullptr) continue;
        const fs::path absolute = ((texture ? texture_folder : mesh_folder) / file).lexically_normal();
        RequireRegularFile(absolute, *asset, name);
        asset->SetAttribute(key, absolute.c_str());
      }
    }
  }
}

}  // namespace

std::string ReadTextFile(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::error_code error;
  if (!in || fs::is_directory(file, error))
    throw InputError(file.string(), "cannot be read", "check the name and the permissions");
  std::string text;  // read to the end, at most to the limit: a device has no size of its own
  std::vector<char> chunk(1 << 16);
  while (in.read(chunk.data(), static_cast<std::streamsize>(chunk.size())) || in.gcount() > 0) {
    text.append(chunk.data(), static_cast<std::size_t>(in.gcount()));
    if (text.size() > kLargestFile) {
      throw InputError(file.string(), "is larger than " + std::to_string(kLargestFile) + " bytes",
                       "give a smaller file");
    }
  }
  if (in.bad()) throw InputError(file.string(), "cannot be read", "check the name and the permissions");
  return text;
}

namespace {

/// Includes spliced in, asset files absolute; the files that were included.
std::set<std::string> Resolve(const std::string& mjcf, const std::string& name, const fs::path& folder,
                              tinyxml2::XMLDocument& document) {
  Parse(mjcf, name, document);
  tinyxml2::XMLElement& root = *document.RootElement();
  if (std::strcmp(root.Name(), "mujoco") != 0) {
    throw InputError(name, "the root element is <" + std::string(root.Name()) + ">",
                     "a task file is MJCF: <mujoco> ... </mujoco>");
  }
  std::error_code error;
  const fs::path absolute = fs::absolute(folder, error).lexically_normal();
  if (error) throw InputError(name, "its folder is not to be found: " + error.message(), "change to another folder");
  Includer includer(absolute, document);
  RequireFiniteNumbers(root, name);
  includer.Resolve(root, name);
  MakeAssetFilesAbsolute(root, name, absolute);
  return includer.included();
}

}  // namespace

std::string ResolveMjcf(const std::string& mjcf, const std::string& name, const fs::path& folder) {
  tinyxml2::XMLDocument document;
  Resolve(mjcf, name, folder, document);
  tinyxml2::XMLPrinter printer;
  document.Print(&printer);
  return printer.CStr();
}

std::vector<std::string> FilesOfMjcf(const std::string& mjcf, const std::string& name, const fs::path& folder) {
  tinyxml2::XMLDocument document;
  const std::set<std::string> included = Resolve(mjcf, name, folder, document);
  std::vector<std::string> files(included.begin(), included.end());
  for (auto* assets = document.RootElement()->FirstChildElement("asset"); assets != nullptr;
       assets = assets->NextSiblingElement("asset")) {
    for (auto* asset = assets->FirstChildElement(); asset != nullptr; asset = asset->NextSiblingElement()) {
      for (const char* key : kFileAttributes) {
        if (const char* file = asset->Attribute(key)) files.emplace_back(file);
      }
    }
  }
  return files;
}

}  // namespace feeler::env
