#include "feeler/evaluation/report/page.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <string_view>

#include "feeler/core/data_folder.h"
#include "feeler/core/error.h"
#include "feeler/env/model/task_file.h"
#include "feeler/env/scene/scene.h"
#include "feeler/evaluation/harness/paper_results.h"
#include "feeler/evaluation/records/scene_geometry.h"
#include "feeler/version.h"

namespace feeler::evaluation {
namespace {

using nlohmann::json;

/// In the order in which the page needs them.
constexpr std::array<const char*, 9> kScripts = {"format.js",  "plots.js",    "tables.js",
                                                 "summary.js", "sections.js", "replay_data.js",
                                                 "scene3d.js", "replay.js",   "app.js"};

std::string ReadText(const std::string& path, const std::string& mend) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw InputError(path, "is not there", mend);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::string PageFile(const std::string& name) {
  return ReadText(FindData("evaluation/report/page").string() + "/" + name, "install feeler again");
}

/// The copy that is installed with feeler, where there is one, else the system's.
std::string Library(const std::string& path) {
  std::string chosen = path;
  try {
    chosen = FindData("evaluation/report/libraries/" + std::filesystem::path(path).filename().string()).string();
  } catch (const InputError&) {  // in the source tree there is none
  }
  return ReadText(chosen, "the page needs libjs-three and node-d3: ./run setup installs them");
}

/// JSON that may stand inside a script element.
std::string Embeddable(std::string text) {
  std::string safe;
  safe.reserve(text.size() + text.size() / 64);
  for (const char c : text) {
    if (c == '<') {
      safe += "\\u003c";
    } else {
      safe += c;
    }
  }
  return safe;
}

std::string Dump(const json& value) { return Embeddable(value.dump(-1, ' ', false, json::error_handler_t::replace)); }

std::string DataElement(const char* id, const std::string& content) {
  return std::string("<script type=\"application/json\" id=\"") + id + "\">" + content + "</script>\n";
}

std::string Script(const std::string& code) {
  if (code.find("</script") != std::string::npos)
    throw InputError("report", "a script holds an end of script", "break the word in two");
  return "<script>\n" + code + "\n</script>\n";
}

/// The scenes of all tasks that have a replay.
json ScenesFor(const Results& results) {
  json scenes = json::object();
  for (const ReportedRecords& records : results.records) {
    if (scenes.contains(records.task)) continue;
    if (const auto found = results.scenes.find(records.task); found != results.scenes.end()) {
      scenes[records.task] = found->second;
      continue;
    }
    try {
      scenes[records.task] = SceneJson(env::BuildScene(env::LoadTask(records.task)));
    } catch (const Error&) {
      scenes[records.task] = nullptr;  // the player says so
    }
  }
  return scenes;
}

json ExperimentJson(const ReportedExperiment& experiment) {
  return {{"name", experiment.name},         {"folder", experiment.folder},     {"columns", experiment.columns},
          {"rows", experiment.rows},         {"manifest", experiment.manifest}, {"figures", experiment.figures},
          {"pictures", experiment.pictures}, {"details", experiment.details}};
}

/// Puts `content` in the place of `mark`, which stands in the template once.
void Fill(std::string& page, const std::string& mark, const std::string& content) {
  const std::size_t at = page.find(mark);
  if (at == std::string::npos) throw InputError("page.html", "has no " + mark, "restore the page from the sources");
  page.replace(at, mark.size(), content);
}

}  // namespace

std::vector<std::vector<bool>> ChooseReplays(const std::vector<ReportedRecords>& records, std::int64_t bytes) {
  std::vector<std::vector<bool>> chosen;
  std::size_t longest = 0;
  for (const ReportedRecords& file : records) {
    chosen.emplace_back(file.episodes.size(), false);
    longest = std::max(longest, file.episodes.size());
  }
  std::int64_t left = bytes;
  for (int turn = 0; turn < 3; ++turn) {
    for (std::size_t k = 0; k < longest; ++k) {
      for (std::size_t f = 0; f < records.size(); ++f) {
        if (k >= records[f].episodes.size() || chosen[f][k]) continue;
        const ReportedEpisode& episode = records[f].episodes[k];
        const int rank = !episode.inserted ? 0 : episode.ladder ? 1 : 2;
        const auto size = static_cast<std::int64_t>(episode.replay.size());
        if (rank != turn || size == 0 || size > left) continue;
        chosen[f][k] = true;
        left -= size;
      }
    }
  }
  return chosen;
}

std::string ReportPage(const Results& results, const std::string& folder, const ReportOptions& options) {
  const std::vector<std::vector<bool>> chosen = ChooseReplays(results.records, options.replay_bytes);
  json data = {{"version", FEELER_VERSION}, {"folder", folder}, {"paper", PaperResults()}};
  data["experiments"] = json::array();
  for (const ReportedExperiment& experiment : results.experiments) {
    data["experiments"].push_back(ExperimentJson(experiment));
  }
  data["faults"] = json::array();
  for (const Fault& fault : results.faults) data["faults"].push_back({fault.where, fault.what, fault.mend});
  data["records"] = json::array();
  std::string replays;
  int lines = 0;
  for (std::size_t f = 0; f < results.records.size(); ++f) {
    const ReportedRecords& records = results.records[f];
    json entry = {{"file", records.file},   {"task", records.task}, {"policy", records.policy},
                  {"noise", records.noise}, {"seed", records.seed}, {"episodes", json::array()}};
    for (std::size_t k = 0; k < records.episodes.size(); ++k) {
      json row = records.episodes[k].row;
      row.push_back(chosen[f][k] ? json(lines) : json(-1));
      entry["episodes"].push_back(std::move(row));
      if (!chosen[f][k]) continue;
      replays += Embeddable(records.episodes[k].replay);
      replays += '\n';
      ++lines;
    }
    data["records"].push_back(std::move(entry));
  }

  std::string page = PageFile("page.html");
  std::string scripts = Script(Library(options.libraries.d3));
  scripts += Script(Library(options.libraries.three)) + Script(Library(options.libraries.orbit_controls));
  for (const char* name : kScripts) scripts += Script(PageFile(name));
  std::string elements = DataElement("feeler-data", Dump(data));
  elements += DataElement("feeler-scenes", lines > 0 ? Dump(ScenesFor(results)) : "{}");
  elements += DataElement("feeler-replays", replays);
  Fill(page, "/*STYLE*/", PageFile("style.css"));
  Fill(page, "<!--DATA-->", elements);
  Fill(page, "<!--SCRIPTS-->", scripts);
  return page;
}

}  // namespace feeler::evaluation
