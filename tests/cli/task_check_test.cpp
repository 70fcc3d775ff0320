// feeler task check. Laws: a task that works has exit code 0; what prevents work is exit code 1, with a line that says
// where, what, how much and how to mend, and its kind in --json; what cannot be read is exit code 2; `preprocess`
// refuses what the quick part finds, and says of an unlocalizable problem that it is one; `solve` prints ten pairs and
// how many there are.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "feeler/env/model/fingerprint.h"
#include "feeler/env/model/task_file.h"
#include "feeler/perception/uncertainty_table.h"
#include "tests/cli/run_feeler.h"
#include "tests/env/task_text.h"

namespace feeler::cli {
namespace {

using env::TaskText;

std::string FileOf(const std::string& name, const std::function<void(TaskText&)>& change) {
  TaskText text;
  text.numbers["feeler_flange_position"] = "0 0 0.15";
  text.numbers["feeler_max_cells"] = "3 3 3";
  text.numbers["feeler_workspace"] = "0.05 0.044 0.034";
  if (change) change(text);
  const std::string file = ScratchFolder(name) + "/peg.xml";
  WriteFile(file, text.Mjcf());
  return file;
}

struct Checked {
  int exit_code = -1;
  std::set<std::string> kinds;
  std::string text;
};

Checked Check(const std::string& name, const std::function<void(TaskText&)>& change) {
  const CommandResult result = RunFeeler({"task", "check", FileOf(name, change), "--json", "--jobs", "1"});
  Checked checked{result.exit_code, {}, result.out + result.err};
  const auto json = nlohmann::json::parse(result.out, nullptr, false);
  if (json.is_discarded()) return checked;
  for (const auto& finding : json["findings"]) {
    checked.kinds.insert(finding["kind"]);
    for (const char* key : {"severity", "where", "what", "mend"}) EXPECT_FALSE(finding[key].get<std::string>().empty());
  }
  EXPECT_EQ(json["works"], result.exit_code == 0);
  return checked;
}

TEST(TaskCheck, ATaskThatWorksHasNoFindings) {
  const Checked sound = Check("sound", {});
  EXPECT_EQ(sound.exit_code, 0) << sound.text;
  EXPECT_TRUE(sound.kinds.empty()) << sound.text;
}

struct Case {
  const char* kind;
  std::function<void(TaskText&)> change;
  std::vector<const char*> says;  ///< how much, and how to mend
};

std::vector<Case> WhatPreventsWork() {
  return {
      {"margin", [](TaskText& t) { t.target.insert(t.target.find("name=\"west\""), "margin=\"0.001\" "); }, {"west"}},
      {"millimetres",
       [](TaskText& t) { t.tool = R"(<geom name="peg" type="box" size="4 4 15" pos="0 0 15"/>)"; },
       {"30 m long", "scale="}},
      {"hull",
       [](TaskText& t) {
         t.extra = env::FrameMesh(0.025);
         t.target = R"(<geom name="frame" type="mesh" mesh="frame"/>
           <geom name="lid" type="box" size="0.005 0.005 0.01" pos="0 0 -0.01" contype="0" conaffinity="0"/>)";
       },
       {"frame", "fills the opening", "three ways"}},
      {"upside-down",
       [](TaskText& t) {
         t.tool += R"(<geom name="key" type="box" size="0.0005 0.0004 0.015" pos="0 0.0044 0.015"/>)";
         t.target += R"(<geom name="stop" type="box" size="0.005 0.0004 0.01" pos="0 0.0046 -0.01"/>)";
       },
       {"\\\"key\\\" of tool meets \\\"stop\\\" of target at (", "turned by 180 degrees"}},
      {"origins",
       [](TaskText& t) { t.tool = R"(<geom name="peg" type="box" size="0.004 0.004 0.015" pos="0.003 0 0.015"/>)"; },
       {"displaced by (-"}},
      {"lid",
       [](TaskText& t) { t.target.replace(t.target.find("\"lid\""), 5, "\"cover\""); },
       {"cover", "not named lid"}},
      {"lid", [](TaskText& t) { t.target.erase(t.target.find("<geom name=\"lid\"")); }, {"no lid", "--opening open"}},
      {"tolerance",
       [](TaskText& t) { t.numbers["feeler_tolerance_lateral"] = "0.002"; },
       {"x -1.000 +1.000 mm, y -1.000 +1.000 mm", "at most 0.001 m"}},
      {"start-clearance",
       [](TaskText& t) { t.numbers["feeler_start_offset"] = "0 0 0.006"; },
       {"4 mm clear", "mm further out"}},
      {"fingers", [](TaskText& t) { t.numbers["feeler_flange_position"] = "0 0 0.03"; }, {"palm", "with z = "}},
      {"upside-down",
       [](TaskText& t) { t.numbers["feeler_flange_quaternion"] = "1 0 0 0"; },
       {"upside down", "0 1 0 0"}},
      {"payload",
       [](TaskText& t) { t.tool.insert(t.tool.find("name=\"peg\""), "mass=\"50\" "); },
       {"50 kg", "12.5 kg"}},
      {"reach", [](TaskText& t) { t.target_body = R"(<body name="target" pos="1.9 0 0.2">)"; }, {"nearer to the base"}},
      {"workspace",
       [](TaskText& t) { t.numbers["feeler_workspace"] = "0.008 0.008 0.02"; },
       {"further towards", " mm", "is enough"}},
  };
}

TEST(TaskCheck, WhatPreventsWorkIsFound) {
  int number = 0;
  for (const Case& c : WhatPreventsWork()) {
    const Checked checked = Check(std::string(c.kind) + std::to_string(++number), c.change);
    EXPECT_EQ(checked.exit_code, 1) << c.kind << ": " << checked.text;
    EXPECT_TRUE(checked.kinds.contains(c.kind)) << c.kind << ": " << checked.text;
    for (const char* part : c.says)
      EXPECT_NE(checked.text.find(part), std::string::npos) << part << ": " << checked.text;
  }
}

TEST(TaskCheck, SeveralObjectsInOneFileAreFound) {
  const std::string folder = ScratchFolder("objects");
  WriteFile(folder + "/two.obj",
            "o core\nv -.004 -.004 0\nv .004 -.004 0\nv 0 .004 0\nv 0 0 .03\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
            "o shell\nv 0 0 .01\nv .003 0 .01\nv 0 .003 .01\nv 0 0 .02\nf 5 7 6\nf 5 6 8\nf 6 7 8\nf 7 5 8\n");
  TaskText text;
  text.extra = R"(<asset><mesh name="two" file="two.obj"/></asset>)";
  text.tool = R"(<geom name="peg" type="mesh" mesh="two"/>)";
  text.numbers["feeler_flange_position"] = "0 0 0.15";
  WriteFile(folder + "/peg.xml", text.Mjcf());
  const CommandResult result = RunFeeler({"task", "check", folder + "/peg.xml", "--jobs", "1"});
  EXPECT_EQ(result.exit_code, 1) << result.out << result.err;
  EXPECT_NE(result.out.find("core, shell"), std::string::npos) << result.out;
}

// A plate whose outside no probe reaches, around an opening that is closed while localizing.
TEST(TaskCheck, AFlushPartNamesTheSpiralWhereItInserts) {
  const Checked checked = Check("flush", [](TaskText& t) {
    t.target = R"(
      <geom name="west" type="box" size="0.1 0.2 0.01" pos="-0.105 0 -0.01"/>
      <geom name="east" type="box" size="0.1 0.2 0.01" pos="0.105 0 -0.01"/>
      <geom name="south" type="box" size="0.005 0.1 0.01" pos="0 -0.105 -0.01"/>
      <geom name="north" type="box" size="0.005 0.1 0.01" pos="0 0.105 -0.01"/>
      <geom name="lid" type="box" size="0.005 0.005 0.01" pos="0 0 -0.01" contype="0" conaffinity="0"/>)";
    t.numbers["feeler_workspace"] = "0.02 0.02 0.034";
  });
  EXPECT_EQ(checked.exit_code, 1) << checked.text;
  EXPECT_TRUE(checked.kinds.contains("blind")) << checked.text;
  for (const char* part : {"no touch tells x, y", "--policy spiral inserts it all the same", "of 3 episodes"}) {
    EXPECT_NE(checked.text.find(part), std::string::npos) << part << ": " << checked.text;
  }
}

TEST(TaskCheck, ACalibrationThatTheTaskCapsNamesTheValue) {
  const std::string file = FileOf("capped", {});
  const env::TaskModel task = env::LoadTask(file);
  perception::UncertaintyTable table;
  table.task = task.task.name;
  table.fingerprint = env::Fingerprint(task, env::Opening::kClosed);
  table.axes = task.task.axes;
  perception::UncertaintyRule rule;
  rule.farthest_m = 2.0;
  rule.half = Eigen::Vector3d(0.0025, 0.009, 0.002);  // 3 cells fit within 3 mm; 9 mm take 9
  rule.samples = 100;
  table.rules = table.plain_rules = {rule};
  const std::string path = ScratchFolder("capped-table") + "/table.json";
  WriteFile(path, perception::ToJson(table));
  const CommandResult result = RunFeeler({"task", "check", file, "--table", path, "--jobs", "1"});
  EXPECT_EQ(result.exit_code, 1) << result.out << result.err;
  for (const char* part : {"feeler_max_cells", "y needs 9 cells and has 3", "\"3 9 3\" holds them"}) {
    EXPECT_NE(result.out.find(part), std::string::npos) << part << ": " << result.out;
  }
}

TEST(TaskCheck, StretchedFingersAreAWarning) {
  const Checked checked = Check("stretched", [](TaskText& t) { t.numbers["feeler_flange_position"] = "0 0 0.3"; });
  EXPECT_EQ(checked.exit_code, 0) << checked.text;
  EXPECT_TRUE(checked.kinds.contains("fingers")) << checked.text;
}

TEST(TaskCheck, WhatCannotBeReadIsBadInput) {
  const CommandResult result = RunFeeler({"task", "check", "no-such-task"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
}

TEST(TaskCheck, ItsQuickPartIsAskedBeforeTimeIsSpent) {
  const std::string file = FileOf("quick", [](TaskText& t) { t.numbers["feeler_flange_quaternion"] = "1 0 0 0"; });
  const std::string out = ScratchFolder("quick-out") + "/x.db";
  const CommandResult result =
      RunFeeler({"preprocess", "--task", file, "--out", out, "--family", "2x2x2", "--jobs", "1"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("upside down"), std::string::npos) << result.err;
}

TEST(Unlocalizable, IsSaidByPreprocessAndCountedBySolve) {
  const std::string file = FileOf("blind", [](TaskText& t) { t.numbers["feeler_workspace"] = "0.004 0.004 0.02"; });
  const std::string out = ScratchFolder("blind-out") + "/x.db";
  const CommandResult built =
      RunFeeler({"preprocess", "--task", file, "--out", out, "--family", "3x3x2", "--jobs", "1"});
  EXPECT_EQ(built.exit_code, 1) << built.err;
  EXPECT_NE(built.err.find("unlocalizable"), std::string::npos) << built.err;
  EXPECT_EQ(built.err.find("internal"), std::string::npos) << built.err;
  // Few enough pairs that --json lists them all: the count is that of the list.
  const CommandResult solved = RunFeeler({"solve", "--task", file, "--extents", "3x3x3", "--jobs", "1", "--json"});
  EXPECT_EQ(solved.exit_code, 1);
  const auto json = nlohmann::json::parse(solved.out);
  const auto pairs = json["indistinguishable_pairs"].get<std::size_t>();
  EXPECT_EQ(pairs, json["indistinguishable"].size());
  EXPECT_GE(pairs, 108U);  // 9 places across the insertion that nothing tells apart, at each of 3 heights
  EXPECT_NE(solved.err.find(std::to_string(pairs) + " pairs of hypotheses"), std::string::npos) << solved.err;
  EXPECT_NE(solved.err.find("10 of them"), std::string::npos) << solved.err;
  EXPECT_LT(std::count(solved.err.begin(), solved.err.end(), '\n'), 20) << solved.err;
}

}  // namespace
}  // namespace feeler::cli
