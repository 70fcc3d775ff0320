#include "feeler/evaluation/harness/cell_store.h"

#include <filesystem>
#include <fstream>
#include <system_error>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/core/json_depth.h"

namespace feeler::evaluation {

using nlohmann::json;

CellStore::CellStore(std::string path, const json& settings) : path_(std::move(path)) {
  std::error_code error;
  const bool fresh = !std::filesystem::exists(path_, error) || std::filesystem::file_size(path_, error) == 0;
  if (!fresh) {
    const std::size_t whole = Read(path_, settings, cells_);
    if (whole < std::filesystem::file_size(path_, error)) std::filesystem::resize_file(path_, whole, error);
    if (error) throw InputError(path_, "cannot be written: " + error.message(), "check its permissions");
  }
  file_ = std::fopen(path_.c_str(), "ab");
  if (file_ == nullptr) throw InputError(path_, "cannot be written", "choose another folder");
  if (fresh || std::filesystem::file_size(path_, error) == 0) WriteLine({{"settings", settings}});
}

CellStore::~CellStore() {
  if (file_ != nullptr) std::fclose(file_);
}

std::size_t CellStore::Read(const std::string& path, const json& settings, Cells& cells) {
  const std::string other = "choose another folder, or move this file away";
  std::error_code error;
  if (!std::filesystem::exists(path, error)) {
    throw InputError(path, "is not there", "give the folder that feeler experiment --out wrote");
  }
  std::string text;
  {
    std::ifstream in(path, std::ios::binary);
    text.assign(std::istreambuf_iterator<char>(in), {});
    if (!in.is_open() || (!in && !in.eof())) throw InputError(path, "cannot be read", other);
  }
  std::size_t begin = 0;
  int number = 0;
  while (begin < text.size()) {
    const std::size_t end = text.find('\n', begin);
    if (end == std::string::npos) break;  // cut off while it was written
    ++number;
    const std::string_view bytes = std::string_view(text).substr(begin, end - begin);
    const auto line = ParseJsonText<json>(bytes);
    const bool header = number == 1;
    const bool valid =
        line.is_object() && (header ? line.contains("settings")
                                    : line.contains("cell") && line["cell"].is_string() && line.contains("value"));
    if (!valid) throw InputError(path, "line " + std::to_string(number) + " is damaged", other);
    if (header && line["settings"] != settings) {
      throw InputError(path, "holds the cells of a run with other settings (" + line["settings"].dump() + ")", other);
    }
    if (!header) cells.insert_or_assign(line["cell"].get<std::string>(), line["value"]);
    begin = end + 1;
  }
  return begin;
}

void CellStore::Adopt(const std::vector<std::string>& paths, const json& settings) {
  std::map<std::string, std::string> holders;
  for (const std::string& path : paths) {
    Cells cells;
    Read(path, settings, cells);
    for (auto& [cell, value] : cells) {
      const auto [other, is_new] = holders.emplace(cell, path);
      if (!is_new) {
        throw InputError(path, "holds the cell \"" + cell + "\", as " + other->second + " does",
                         "give each shard once");
      }
      if (Find(cell) == nullptr) Put(cell, std::move(value));
    }
  }
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
