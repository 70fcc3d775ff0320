#pragma once

#include <cstdio>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace feeler::evaluation {

/// The finished cells of an experiment, in a JSON Lines file that grows as they are measured, so that an interrupted
/// experiment goes on where it stopped. The first line holds the settings; each further one `{"cell": key, "value":
/// ...}`.
///
/// Law: a process killed at any moment loses at most the cell that it was writing. One process at a time.
class CellStore {
 public:
  /// Opens or creates `path`. A cut-off last line is dropped. Throws InputError if the file was made under other
  /// settings, is damaged, or cannot be written.
  CellStore(std::string path, const nlohmann::json& settings);
  /// Takes over the finished cells of other stores, those of shards. Throws InputError if one cannot be read, was made
  /// under other settings, or holds a cell that another of them holds too.
  void Adopt(const std::vector<std::string>& paths, const nlohmann::json& settings);
  ~CellStore();
  CellStore(const CellStore&) = delete;
  CellStore& operator=(const CellStore&) = delete;

  const std::string& path() const { return path_; }
  /// The value of a cell, or null if it is not finished. Valid as long as the store.
  const nlohmann::json* Find(const std::string& cell) const;
  /// Keeps a finished cell. Throws InputError if it cannot be written.
  void Put(const std::string& cell, nlohmann::json value);

 private:
  using Cells = std::map<std::string, nlohmann::json>;
  /// Returns how many bytes of the file are whole lines.
  static std::size_t Read(const std::string& path, const nlohmann::json& settings, Cells& cells);
  void WriteLine(const nlohmann::json& line);

  std::string path_;
  mutable std::mutex mutex_;
  Cells cells_;
  std::FILE* file_ = nullptr;
};

}  // namespace feeler::evaluation
