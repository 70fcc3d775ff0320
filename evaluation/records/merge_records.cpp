#include "feeler/evaluation/records/merge_records.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <fstream>
#include <iterator>
#include <map>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/core/file_output.h"
#include "feeler/core/json_depth.h"

namespace feeler::evaluation {
namespace {

struct File {
  std::string path;
  RecordsShard said;
};

/// Lines by episode; cut-off and foreign ones are refused.
void ReadLines(const File& file, std::map<std::int64_t, std::string>& lines) {
  std::ifstream in(file.path, std::ios::binary);
  if (!in) throw InputError(file.path, "cannot be read", "give a records file written by feeler run --shard");
  const std::vector<std::int64_t> expected = workflow::NumbersOfShard(0, file.said.episodes, file.said.shard);
  std::size_t present = 0;
  for (std::string line; std::getline(in, line);) {
    const std::string where = fmt::format("{} line {}", file.path, present + 1);
    const auto record = ParseJsonText<nlohmann::json>(line);
    if (in.eof() || !record.is_object() || !record.contains("episode") || !record["episode"].is_number_integer()) {
      throw InputError(where, "is no episode record", "run the shard again");
    }
    const auto episode = record["episode"].get<std::int64_t>();
    if (present >= expected.size() || episode != expected[present]) {
      throw InputError(where,
                       fmt::format("holds episode {}, which is not the next of shard {} of {}", episode,
                                   file.said.shard.index, file.said.shard.count),
                       "run the shard again");
    }
    lines.emplace(episode, std::move(line));
    ++present;
  }
  if (present != expected.size()) {
    throw InputError(file.path,
                     fmt::format("is unfinished: {} of the {} episodes of shard {} of {}", present, expected.size(),
                                 file.said.shard.index, file.said.shard.count),
                     "run the shard again");
  }
}

/// The first setting in which two runs differ.
std::string Difference(const nlohmann::json& have, const nlohmann::json& want) {
  for (const auto& [key, value] : want.items()) {
    if (!have.contains(key) || have[key] != value) {
      return fmt::format("{} ({}, not {})", key, have.contains(key) ? have[key].dump() : "none", value.dump());
    }
  }
  return "settings";
}

void RequireAllShards(const std::vector<File>& files) {
  const RecordsShard& first = files.front().said;
  std::map<int, std::string> there;
  for (const File& file : files) {
    const RecordsShard& said = file.said;
    if (said.settings != first.settings) {
      throw InputError(file.path,
                       fmt::format("is of another run than {}: another {}", files.front().path,
                                   Difference(said.settings, first.settings)),
                       "merge the shards of one run");
    }
    if (said.episodes != first.episodes || said.shard.count != first.shard.count) {
      throw InputError(file.path,
                       fmt::format("is one of {} shards of {} episodes, {} one of {} of {}", said.shard.count,
                                   said.episodes, files.front().path, first.shard.count, first.episodes),
                       "merge the shards of one run");
    }
    const auto [other, is_new] = there.emplace(said.shard.index, file.path);
    if (!is_new) {
      throw InputError(file.path,
                       fmt::format("is shard {} of {}, as {} is", said.shard.index, said.shard.count, other->second),
                       "give each shard once");
    }
  }
  std::string missing;
  for (int index = 1; index <= first.shard.count; ++index) {
    if (!there.contains(index)) missing += fmt::format("{}{}", missing.empty() ? "" : ", ", index);
  }
  if (missing.empty()) return;
  throw InputError("shards", fmt::format("{} of {} missing", missing, first.shard.count),
                   fmt::format("make them with --shard I/{} and give all files", first.shard.count));
}

}  // namespace

std::string ShardFileOf(const std::string& records) { return records + ".shard.json"; }

void WriteRecordsShard(const std::string& records, const RecordsShard& shard) {
  const nlohmann::json text = {{"shard", {{"index", shard.shard.index}, {"count", shard.shard.count}}},
                               {"episodes", shard.episodes},
                               {"settings", shard.settings}};
  WriteFileAtomically(ShardFileOf(records), text.dump(2) + "\n");
}

RecordsShard ReadRecordsShard(const std::string& records) {
  const std::string path = ShardFileOf(records);
  std::ifstream in(path, std::ios::binary);
  if (!in)
    throw InputError(records, "is no shard: " + path + " is missing", "make it with feeler run --shard I/N --out");
  try {
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    const auto said = ParseJsonText<nlohmann::json>(text);
    RecordsShard shard;
    shard.shard = {said.at("shard").at("index").get<int>(), said.at("shard").at("count").get<int>()};
    shard.episodes = said.at("episodes").get<std::int64_t>();
    shard.settings = said.at("settings");
    const bool sane = shard.shard.count >= 1 && shard.shard.count <= workflow::kMostShards && shard.shard.index >= 1 &&
                      shard.shard.index <= shard.shard.count && shard.episodes >= 0 && shard.settings.is_object();
    if (sane) return shard;
  } catch (const nlohmann::json::exception&) {  // NOLINT(bugprone-empty-catch): as below
  }
  throw InputError(path, "is damaged", "run the shard again");
}

std::vector<EpisodeSummaryRow> MergeRecords(const std::vector<std::string>& paths, const std::string& out) {
  if (paths.size() < 2) throw InputError("records merge", "one file is nothing to merge", "give all shards of a run");
  struct stat status {};
  if (IsReplaceable(out) && stat(out.c_str(), &status) == 0 && status.st_size > 0) {
    throw InputError(out, "exists already: it is not overwritten", "give another name");
  }
  std::vector<File> files;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      if (IsSameFile(paths[i], paths[k])) throw InputError(paths[i], "is given twice", "give each file once");
    }
    files.push_back({paths[i], ReadRecordsShard(paths[i])});
  }
  RequireAllShards(files);
  std::map<std::int64_t, std::string> lines;
  for (const File& file : files) ReadLines(file, lines);
  std::vector<EpisodeSummaryRow> rows;
  OutputFile output(out);
  for (const auto& [episode, line] : lines) {
    try {
      rows.push_back(SummaryRow(ParseJsonText<nlohmann::json>(line)));
    } catch (const nlohmann::json::exception& e) {
      throw InputError(fmt::format("episode {}", episode), std::string("is no record: ") + e.what(),
                       "run its shard again");
    }
    output.Write(line + "\n");
  }
  output.Commit();
  return rows;
}

}  // namespace feeler::evaluation
