#include "feeler/evaluation/harness/cell_store.h"

#include <filesystem>
#include <fstream>
#include <utility>

#include "feeler/core/error.h"

namespace feeler::evaluation {

using nlohmann::json;

CellStore::CellStore(std::string path, const json& settings) : path_(std::move(path)) {
  const bool fresh = !std::filesystem::exists(path_) || std::filesystem::file_size(path_) == 0;
  if (!fresh) Read(settings);
  file_ = std::fopen(path_.c_str(), "ab");
  if (file_ == nullptr) throw InputError(path_, "cannot be written", "choose another folder");
  if (fresh || std::filesystem::file_size(path_) == 0) WriteLine({{"settings", settings}});
}

CellStore::~CellStore() {
  if (file_ != nullptr) std::fclose(file_);
}

void CellStore::Read(const json& settings) {
  const std::string other = "delete it or choose another folder";
  std::string text;
  {
    std::ifstream in(path_, std::ios::binary);
    text.assign(std::istreambuf_iterator<char>(in), {});
    if (!in && !in.eof()) throw InputError(path_, "cannot be read", other);
  }
  std::size_t begin = 0;
  int number = 0;
  while (begin < text.size()) {
    const std::size_t end = text.find('\n', begin);
    if (end == std::string::npos) break;  // cut off while it was written
    ++number;
    const json line = json::parse(text.begin() + static_cast<std::ptrdiff_t>(begin),
                                  text.begin() + static_cast<std::ptrdiff_t>(end), nullptr, false);
    const bool header = number == 1;
    const bool valid =
        line.is_object() && (header ? line.contains("settings")
                                    : line.contains("cell") && line["cell"].is_string() && line.contains("value"));
    if (!valid) throw InputError(path_, "line " + std::to_string(number) + " is damaged", other);
    if (header && line["settings"] != settings) {
      throw InputError(path_, "holds the cells of a run with other settings (" + line["settings"].dump() + ")", other);
    }
    if (!header) cells_.insert_or_assign(line["cell"].get<std::string>(), line["value"]);
    begin = end + 1;
  }
  if (begin < text.size()) std::filesystem::resize_file(path_, begin);
}

const json* CellStore::Find(const std::string& cell) const {
  const std::lock_guard lock(mutex_);
  const auto it = cells_.find(cell);
  return it == cells_.end() ? nullptr : &it->second;
}

void CellStore::Put(const std::string& cell, json value) {
  const std::lock_guard lock(mutex_);
  WriteLine({{"cell", cell}, {"value", value}});
  cells_.insert_or_assign(cell, std::move(value));
}

void CellStore::WriteLine(const json& line) {
  const std::string text = line.dump() + "\n";
  if (std::fwrite(text.data(), 1, text.size(), file_) != text.size() || std::fflush(file_) != 0) {
    throw InputError(path_, "cannot be written", "check the free space");
  }
}

}  // namespace feeler::evaluation
