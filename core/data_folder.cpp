#include "feeler/core/data_folder.h"

#include <dlfcn.h>

#include <cstdlib>
#include <system_error>
#include <vector>

#include "feeler/core/error.h"

namespace feeler {
namespace {

namespace fs = std::filesystem;

fs::path& GivenFolder() {
  static fs::path folder;
  return folder;
}

fs::path FromEnvironment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? fs::path() : fs::path(value);
}

bool IsBelow(const fs::path& file, const fs::path& folder) {
  const fs::path relative = file.lexically_relative(folder);
  return !relative.empty() && *relative.begin() != "..";
}

/// Files that hold this code: the program, and the shared library if it is one.
std::vector<fs::path> OwnFiles() {
  std::error_code error;
  std::vector<fs::path> files;
  Dl_info info{};
  if (dladdr(reinterpret_cast<const void*>(&GivenFolder), &info) != 0 && info.dli_fname != nullptr) {
    const fs::path library = fs::canonical(info.dli_fname, error);
    if (!error) files.push_back(library);
  }
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (!error) files.push_back(program);
  return files;
}

std::vector<fs::path> Candidates(const std::string& name) {
  std::vector<fs::path> candidates;
  for (const fs::path& folder : {GivenFolder(), FromEnvironment("FEELER_DATA_DIR")}) {
    if (!folder.empty()) candidates.push_back(folder / name);
  }
  const std::vector<fs::path> files = OwnFiles();
  for (const fs::path& file : files) {
    const fs::path beside = file.parent_path().parent_path();  // bin/ or lib/, or a folder below lib/
    for (const fs::path& prefix : {beside, beside.parent_path()}) {
      candidates.push_back(prefix / "share" / "feeler" / name);
    }
  }
  for (const fs::path& file : files) {
    if (IsBelow(file, FEELER_BUILD_DIR)) candidates.push_back(fs::path(FEELER_SOURCE_DIR) / name);
  }
  candidates.push_back(fs::path(FEELER_INSTALLED_DATA) / name);
  return candidates;
}

}  // namespace

fs::path FindData(const std::string& name) {
  std::error_code error;
  if (fs::path models = FromEnvironment("FEELER_MODELS"); name == "models" && !models.empty()) {
    if (fs::is_directory(models, error)) return models;
    throw InputError(models.string(), "FEELER_MODELS names no folder", "let it name a folder with tasks/ in it");
  }
  std::vector<fs::path> looked;
  for (const fs::path& candidate : Candidates(name)) {
    if (fs::exists(candidate, error)) return candidate;
    if (looked.empty() || looked.back() != candidate) looked.push_back(candidate);
  }
  std::string list;
  for (const fs::path& candidate : looked) list += (list.empty() ? "" : ", ") + candidate.string();
  throw InputError(
      name, "not found; looked for " + list,
      name == "models" ? "let FEELER_MODELS name the folder of models" : "let FEELER_DATA_DIR name share/feeler");
}

void SetDataFolder(const fs::path& folder) { GivenFolder() = folder; }

}  // namespace feeler
