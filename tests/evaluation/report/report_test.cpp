// Laws of the report: packing loses less than a step; a fault in a folder is named by file and line and takes nothing
// else with it; what fits into the page is chosen failures first; the page is one file that a browser opens without a
// complaint, draws, and plays, by pointer and keyboard; a thousand episodes stay small and open quickly.

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "feeler/core/error.h"
#include "feeler/evaluation/harness/episode_sweep.h"
#include "feeler/evaluation/records/replay_json.h"
#include "feeler/evaluation/report/page.h"
#include "feeler/evaluation/report/results_folder.h"
#include "tests/evaluation/report/headless_browser.h"

namespace feeler::evaluation {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

/// Of this process alone: tests run side by side. Removed at its end.
std::string NewFolder(const std::string& name) {
  struct Parent {
    fs::path path = fs::path(::testing::TempDir()) / ("feeler_report_" + std::to_string(getpid()));
    ~Parent() {
      std::error_code ignored;
      fs::remove_all(path, ignored);
    }
  };
  static const Parent parent;
  const fs::path folder = parent.path / name;
  fs::remove_all(folder);
  fs::create_directories(folder);
  return folder.string();
}

void Write(const std::string& path, const std::string& content) {
  fs::create_directories(fs::path(path).parent_path());
  std::ofstream(path, std::ios::binary) << content;
}

std::string Read(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::vector<std::uint64_t> Varints(const std::vector<std::uint8_t>& bytes) {
  std::vector<std::uint64_t> values{0};
  int shift = 0;
  for (const std::uint8_t byte : bytes) {
    values.back() |= static_cast<std::uint64_t>(byte & 0x7F) << shift;
    shift += 7;
    if (byte < 0x80) {
      values.push_back(0);
      shift = 0;
    }
  }
  values.pop_back();
  return values;
}

TEST(ReplayPackingTest, JointsComeBackWithinHalfAStep) {
  std::vector<env::JointVector> q_rad;
  for (int i = 0; i < 50; ++i) {
    env::JointVector q;
    for (int j = 0; j < env::kJointCount; ++j) q[j] = 3.0 * std::sin(0.1 * i + j) - (j == 2 ? 6.2 : 0.0);
    q_rad.push_back(q);
  }
  const std::vector<std::uint64_t> packed = Varints(PackJoints(q_rad));
  ASSERT_EQ(packed.size(), q_rad.size() * env::kJointCount);
  std::int64_t now[env::kJointCount] = {};
  for (std::size_t i = 0; i < packed.size(); ++i) {
    const auto joint = i % env::kJointCount;
    now[joint] += static_cast<std::int64_t>(packed[i] >> 1) ^ -static_cast<std::int64_t>(packed[i] & 1);
    EXPECT_NEAR(2e-5 * static_cast<double>(now[joint]), q_rad[i / env::kJointCount][static_cast<int>(joint)], 1.01e-5);
  }
}

TEST(ReplayPackingTest, RunsAndBase64) {
  EXPECT_EQ(Varints(PackRuns({0, 0, 0, 5, 5, 300})), (std::vector<std::uint64_t>{0, 3, 5, 2, 300, 1}));
  const auto encode = [](const std::string& text) {
    return Base64(std::vector<std::uint8_t>(text.begin(), text.end()));
  };
  EXPECT_EQ(encode(""), "");
  EXPECT_EQ(encode("f"), "Zg==");
  EXPECT_EQ(encode("fo"), "Zm8=");
  EXPECT_EQ(encode("foobar"), "Zm9vYmFy");
}

TEST(ReplayPackingTest, AHypothesisIsRuledOutByTheFirstDecisionWithoutIt) {
  execution::ExecutionRecord execution;
  execution.decisions.resize(3);
  execution.decisions[0].left = {1, 2, 4};
  execution.decisions[1].left = {2};
  execution.decisions[2].attempt = 1;  // another problem: its numbers mean something else
  EXPECT_EQ(RuledOutBy(execution, 5), (std::vector<int>{1, 2, 0, 1, 2}));
}

TEST(ChooseReplaysTest, FailuresThenFallbacksThenSomeOfEveryRun) {
  std::vector<ReportedRecords> records(2);
  for (int k = 0; k < 6; ++k) {
    for (ReportedRecords& file : records) {
      ReportedEpisode episode;
      episode.replay = std::string(100, 'x');
      episode.inserted = true;
      file.episodes.push_back(episode);
    }
  }
  records[0].episodes[5].inserted = false;
  records[1].episodes[4].ladder = true;
  const auto count = [](const std::vector<bool>& chosen) { return std::count(chosen.begin(), chosen.end(), true); };
  auto chosen = ChooseReplays(records, 250);
  EXPECT_TRUE(chosen[0][5]);
  EXPECT_TRUE(chosen[1][4]);
  EXPECT_EQ(count(chosen[0]) + count(chosen[1]), 2);
  chosen = ChooseReplays(records, 600);
  EXPECT_EQ(count(chosen[0]), 3);
  EXPECT_EQ(count(chosen[1]), 3);
  chosen = ChooseReplays(records, 0);
  EXPECT_EQ(count(chosen[0]) + count(chosen[1]), 0);
}

/// Two episodes of a small problem, in physics, once for all tests.
const std::string& EpisodesFolder() {
  static const std::string folder = [] {
    const std::string made = NewFolder("episodes");
    ExperimentRequest request;
    request.out = made;
    request.seed = 5;
    EpisodeSetting setting;
    setting.name = "small";
    setting.extents = "3x3x3";
    setting.episodes = 2;
    EpisodeSweep sweep("sweep", {setting}, request);
    sweep.Run();
    return made;
  }();
  return folder;
}

std::vector<std::string> Lines() {
  std::vector<std::string> lines;
  std::ifstream in(EpisodesFolder() + "/sweep/small.jsonl");
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

/// A folder with `count` episodes made of the two, a table with intervals and printed values, and a figure.
std::string ResultsFolder(const std::string& name, int count) {
  const std::string folder = NewFolder(name);
  const std::vector<std::string> lines = Lines();
  std::string records;
  for (int i = 0; i < count; ++i) {
    json record = json::parse(lines[static_cast<std::size_t>(i) % lines.size()]);
    record["episode"] = i;
    if (i % 50 == 7) {
      record["inserted"] = false;
      record["reason"] = "stuck: at <3 mm> & \"quoted\"";
    }
    records += record.dump() + "\n";
  }
  Write(folder + "/runs/plug_ideal.jsonl", records);
  fs::copy(EpisodesFolder() + "/sweep/plug.scene.json", folder + "/runs/plug.scene.json");
  ResultTable table;
  table.columns = {"row", "success_percent", "success_low_percent", "success_high_percent", "printed_success_percent"};
  table.rows = {{"ours", 100.0, 96.0, 100.0, 95.0}, {"theirs", 80.0, 70.0, 88.0, nullptr}};
  const Manifest manifest{"feeler experiment unknown --out x", {{"experiment", "unknown"}}, {1}};
  WriteExperiment(folder, "unknown", table,
                  {{"title", "An experiment that the page does not know"},
                   {"manifest", ManifestJson(manifest)},
                   {"figures",
                    {{{"title", "Time"},
                      {"x_label", "hypotheses"},
                      {"y_label", "s"},
                      {"x_log", true},
                      {"y_log", true},
                      {"series",
                       {{{"name", "a"},
                         {"points",
                          {{{"x", 8}, {"y", 0.1}, {"low", 0.05}, {"high", 0.2}},
                           {{"x", 27}, {"y", 0.4}, {"low", 0.3}, {"high", 0.6}}}}}}}}}}},
                  manifest);
  return folder;
}

TEST(ReportTest, RecordsHoldReplaysThatSayTheSameAsTheRecord) {
  for (const std::string& line : Lines()) {
    const json record = json::parse(line);
    const json& replay = record.at("replay");
    EXPECT_EQ(replay["hypotheses"], 27);
    EXPECT_GT(replay["samples"].get<int>(), 20);
    ASSERT_FALSE(replay["decisions"].empty());
    EXPECT_LT(replay["decisions"].back()[7].get<int>(), 27) << "touches ruled nothing out";
    double time_s = replay["start_s"];
    for (const json& move : record["moves"]) time_s += move["duration_s"].get<double>();
    const double last_s = replay["period_s"].get<double>() * (replay["samples"].get<double>() - 1.0);
    EXPECT_NEAR(last_s, time_s, 0.06) << "samples cover the episode";
    EXPECT_LT(line.size(), 20'000U);
  }
}

TEST(ReportTest, FaultsAreNamedAndTheRestIsReported) {
  const std::string folder = ResultsFolder("faults", 4);
  const std::vector<std::string> lines = Lines();
  json edited = json::parse(lines[0]);
  edited["sim_time_s"] = "fast";
  json poked = json::parse(lines[0]);
  poked["episode"] = 3;
  poked["replay"]["joints"] = "no base64!";
  Write(folder + "/bad.jsonl", lines[0] + "\n" + edited.dump() + "\n" + lines[0] + "\n" + lines[1].substr(0, 300) +
                                   "\n\n" + poked.dump() + "\n");
  Write(folder + "/empty.jsonl", "");
  Write(folder + "/half.json", R"({"name": "half", "colu)");
  Write(folder + "/lonely.csv", "a,b\n1,2\n");
  json old = json::parse(Read(folder + "/unknown.json"));
  old["details"]["manifest"]["version"] = "0.0.9";
  Write(folder + "/unknown.json", old.dump());
  Write(folder + "/unknown.csv", "row,success_percent\nours,100\n");
  const Results results = ReadResults(folder);
  const auto said = [&](const std::string& where, const std::string& what) {
    return std::any_of(results.faults.begin(), results.faults.end(), [&](const Fault& fault) {
      return fault.where == where && fault.what.find(what) != std::string::npos && !fault.mend.empty();
    });
  };
  EXPECT_TRUE(said("bad.jsonl line 2", "\"sim_time_s\" is no number"));
  EXPECT_TRUE(said("bad.jsonl line 3", "episode of line 1 again"));
  EXPECT_TRUE(said("bad.jsonl line 4", "cut off"));
  EXPECT_TRUE(said("bad.jsonl line 6", "base64"));
  EXPECT_TRUE(said("empty.jsonl", "no episode"));
  EXPECT_TRUE(said("half.json", "cut off"));
  EXPECT_TRUE(said("lonely.csv", "stands without"));
  EXPECT_TRUE(said("unknown.json", "version 0.0.9"));
  EXPECT_TRUE(said("unknown.csv", "edited"));
  EXPECT_EQ(results.faults.size(), 9U);
  ASSERT_EQ(results.records.size(), 2U);
  EXPECT_EQ(results.records[0].file, "bad.jsonl");
  EXPECT_EQ(results.records[0].episodes.size(), 1U);
  EXPECT_EQ(results.records[1].episodes.size(), 4U);
  ASSERT_EQ(results.experiments.size(), 1U);
  EXPECT_EQ(results.experiments[0].rows.size(), 2U);
}

TEST(ReportTest, RunsOfARobotAreToldApartAndDryOnesLeftOut) {
  const std::string folder = ResultsFolder("robot", 1);
  json first = json::parse(Lines()[0]);
  first["noise"] = "real";
  json second = first;
  first["started"] = "2026-11-29T17:40:12Z";
  second["started"] = "2026-11-29T17:52:03Z";
  json dry = first;
  dry["dry"] = true;
  json wrong = first;
  wrong["started"] = "yesterday";
  std::string text;
  for (const json& record : {first, dry, second, second, wrong}) text += record.dump() + "\n";
  Write(folder + "/robot.jsonl", text);
  const Results results = ReadResults(folder);
  const auto robot = std::find_if(results.records.begin(), results.records.end(),
                                  [](const ReportedRecords& records) { return records.file == "robot.jsonl"; });
  ASSERT_NE(robot, results.records.end());
  EXPECT_EQ(robot->episodes.size(), 2U);
  const auto told = [&](const std::string& where, const std::string& what) {
    return std::any_of(results.faults.begin(), results.faults.end(), [&](const Fault& fault) {
      return fault.where == where && fault.what.find(what) != std::string::npos;
    });
  };
  EXPECT_TRUE(told("robot.jsonl", "1 of dry runs"));
  EXPECT_TRUE(told("robot.jsonl line 4", "episode of line 3 again"));
  EXPECT_TRUE(told("robot.jsonl line 5", "\"started\""));
}

TEST(ReportTest, FoldersThatHoldNothingAreRefused) {
  EXPECT_THROW(ReadResults(NewFolder("nothing")), InputError);
  EXPECT_THROW(ReadResults(NewFolder("gone") + "/gone"), InputError);
  const std::string folder = NewFolder("file");
  Write(folder + "/a.txt", "x");
  EXPECT_THROW(ReadResults(folder + "/a.txt"), InputError);
  EXPECT_THROW(ReadResults(folder), InputError);
}

TEST(ReportTest, MissingLibrariesAreNamed) {
  const Results results = ReadResults(ResultsFolder("libraries", 1));
  ReportOptions options;
  options.libraries.three = "/nowhere/three.min.js";
  try {
    ReportPage(results, "x", options);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("/nowhere/three.min.js"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("libjs-three"), std::string::npos);
  }
}

TEST(ReportTest, TheSameResultsGiveTheSamePage) {
  const std::string folder = ResultsFolder("same", 2);
  EXPECT_EQ(ReportPage(ReadResults(folder), "out"), ReportPage(ReadResults(folder), "out"));
}

/// The page of a folder, opened.
BrowserAnswer Open(const std::string& folder, int width, int height) {
  const std::string page = ReportPage(ReadResults(folder), "results");
  Write(folder + "/report.html", page);
  return OpenPage(folder + "/report.html", folder, width, height);
}

class ReportPageTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (FindChromium().empty()) GTEST_SKIP() << "chromium is not installed (packages.txt lists it)";
  }
};

TEST_F(ReportPageTest, DrawsPlaysAndObeysTheKeyboard) {
  const std::string folder = ResultsFolder("page", 9);
  Write(folder + "/bad.jsonl", "{\"cut\":\n");
  const BrowserAnswer answer = Open(folder, 1280, 900);
  for (const std::string& problem : answer.problems) ADD_FAILURE() << "console: " << problem;
  ASSERT_TRUE(answer.check.is_object()) << "the page never answered";
  const json& c = answer.check;
  SCOPED_TRACE(c.dump(1));
  EXPECT_EQ(c.value("exception", ""), "");
  EXPECT_EQ(c["errors"], json::array());
  EXPECT_EQ(c["requests"], json::array()) << "the page loads something";
  EXPECT_FALSE(c["wider_than_window"].get<bool>());
  EXPECT_GE(c["plots"].get<int>(), 2) << "the figure and the strips";
  EXPECT_GE(c["marks"].get<int>(), 2 + 9);
  EXPECT_GE(c["intervals"].get<int>(), 2);
  EXPECT_GE(c["tables"].get<int>(), 3);
  EXPECT_GE(c["cards"].get<int>(), 2);
  EXPECT_EQ(c["faults"], 1);
  ASSERT_TRUE(c["opened"].get<bool>());
  ASSERT_TRUE(c["webgl"].get<bool>());
  EXPECT_GT(c["colors"].get<int>(), 30) << "the stage is empty";
  EXPECT_EQ(c["hypotheses"], 27);
  EXPECT_EQ(c["left"], c["last_left"]) << "dots and decisions say different things";
  EXPECT_NEAR(c["end_s"].get<double>(), c["clock_end_s"].get<double>(), 0.06);
  EXPECT_EQ(c["badge"], "inserted");
  EXPECT_NEAR(c["depth_m"].get<double>(), 0.018, 0.0015) << "the arm drawn is not where the arm was";
  EXPECT_LT(c["aside_m"].get<double>(), 0.001);
  EXPECT_EQ(c["home_s"], 0.0);
  EXPECT_DOUBLE_EQ(c["after_right_s"].get<double>(), c["start_s"].get<double>());
  EXPECT_DOUBLE_EQ(c["after_second_right_s"].get<double>(), c["first_motion_end_s"].get<double>());
  EXPECT_DOUBLE_EQ(c["after_left_s"].get<double>(), c["start_s"].get<double>());
  EXPECT_GT(c["after_dot_s"].get<double>(), c["after_left_s"].get<double>());
  EXPECT_EQ(c["view"], "arm");
  EXPECT_EQ(c["xray"], "true");
  EXPECT_TRUE(c["next_episode"].get<bool>());
  EXPECT_TRUE(c["same_episode"].get<bool>());
  EXPECT_TRUE(c["playing"].get<bool>());
  EXPECT_GT(c["played_s"].get<double>(), 0.3);
  EXPECT_GE(c["frames"].get<int>(), 2);
  EXPECT_TRUE(c["paused"].get<bool>());
  EXPECT_EQ(c["theme"], "dark");
}

TEST_F(ReportPageTest, AThousandEpisodesStaySmallAndOpenQuicklyOnAPhoneToo) {
  const std::string folder = ResultsFolder("thousand", 1000);
  const std::string page = ReportPage(ReadResults(folder), "results");
  EXPECT_LE(page.size(), 20'000'000U);
  BrowserAnswer answer = Open(folder, 390, 844);
  ASSERT_TRUE(answer.check.is_object());
  EXPECT_EQ(answer.check.value("exception", ""), "");
  EXPECT_TRUE(answer.problems.empty());
  EXPECT_FALSE(answer.check["wider_than_window"].get<bool>());
  // On a machine that does other things at the same time the first try may be late.
  if (answer.check["ready_ms"].get<int>() > 3000) answer = Open(folder, 390, 844);
  EXPECT_LE(answer.check["ready_ms"].get<int>(), 3000);
}

}  // namespace
}  // namespace feeler::evaluation
