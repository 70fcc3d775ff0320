// Fingerprints. Laws: what does not change the policies (names, colours, visual geoms, comments, the order of geoms,
// the place in the world, masses) does not change the fingerprint;  any geometry, lattice, cost, opening does;  the
// fingerprint of the contact map does not depend on costs and goals.

#include "feeler/env/model/fingerprint.h"

#include <gtest/gtest.h>

#include <functional>
#include <set>

#include "feeler/env/model/task_file.h"
#include "tests/env/task_text.h"

namespace feeler::env {
namespace {

constexpr const char* kWedge =
    R"(<asset><mesh name="wedge" vertex="0 0 0  0.03 0 0  0 0.02 0  0 0 0.025  0.03 0 0.025"/></asset>)";

TaskText Base() {
  TaskText text;
  text.extra = kWedge;
  text.target += R"(<geom name="wedge" type="mesh" mesh="wedge" pos="0.03 0.03 -0.03"/>)";
  return text;
}

struct Prints {
  std::string task;
  std::string map;
};
Prints PrintsOf(const std::function<void(TaskText&)>& change, Opening opening = Opening::kClosed) {
  TaskText text = Base();
  change(text);
  const TaskModel task_model = LoadTaskFromText(text.Mjcf(), "peg.xml");
  return {Fingerprint(task_model, opening), ContactMapFingerprint(task_model, opening)};
}
void Replace(std::string& text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  ASSERT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
}

TEST(Fingerprint, IsThirtyTwoHexadecimalDigits) {
  const Prints prints = PrintsOf([](TaskText&) {});
  EXPECT_EQ(prints.task.size(), 32U);
  EXPECT_EQ(prints.task.find_first_not_of("0123456789abcdef"), std::string::npos);
  EXPECT_NE(prints.task, prints.map);
}

TEST(Fingerprint, DoesNotDependOnWhatDoesNotMatter) {
  const Prints base = PrintsOf([](TaskText&) {});
  const std::vector<std::function<void(TaskText&)>> changes = {
      [](TaskText& t) { Replace(t.tool, "peg", "spigot"); },
      [](TaskText& t) { Replace(t.target, "name=\"west\"", "name=\"west\" rgba=\"1 0 0 1\" mass=\"3\""); },
      [](TaskText& t) { t.target += R"(<geom size="0.1" contype="0" conaffinity="0"/>)"; },
      [](TaskText& t) { t.tool += "<!-- a comment -->"; },
      [](TaskText& t) { t.target_body = R"(<body name="target" pos="0.4 0.21 0.1" euler="0 0 33">)"; },
      [](TaskText& t) { t.tool_body = R"(<body name="tool" pos="0 0 1" euler="10 20 30">)"; },
      [](TaskText& t) { t.extra += "<option timestep=\"0.0005\"/>"; },
      [](TaskText& t) { t.numbers["feeler_flange_position"] = "0 0 0.2"; },
      [](TaskText& t) {
        const auto east = t.target.find("<geom name=\"east\"");
        const std::string line = t.target.substr(east, t.target.find("/>", east) + 2 - east);
        Replace(t.target, line, "");
        t.target += line;
      },
      // A geom in a child body at the same place.
      [](TaskText& t) {
        t.tool = "<body pos=\"0 0 0.005\">" + t.tool + "</body>";
        Replace(t.tool, "0 0 0.015\"", "0 0 0.01\"");
      },
  };
  for (std::size_t i = 0; i < changes.size(); ++i) {
    const Prints prints = PrintsOf(changes[i]);
    EXPECT_EQ(prints.task, base.task) << i;
    EXPECT_EQ(prints.map, base.map) << i;
  }
}

TEST(Fingerprint, ChangesWithEverythingElse) {
  const auto set = [](const char* field, const char* value) { return [=](TaskText& t) { t.numbers[field] = value; }; };
  const std::vector<std::function<void(TaskText&)>> of_map = {
      [](TaskText& t) { Replace(t.tool, "size=\"0.004 ", "size=\"0.00400001 "); },
      [](TaskText& t) { Replace(t.target, "pos=\"-0.015 ", "pos=\"-0.01500001 "); },
      [](TaskText& t) { Replace(t.target, "type=\"box\" size=\"0.005", "type=\"ellipsoid\" size=\"0.005"); },
      [](TaskText& t) { Replace(t.extra, "0 0.02 0", "0 0.02001 0"); },
      [](TaskText& t) { Replace(t.target, "pos=\"0.03 0.03 -0.03\"", "pos=\"0.03 0.03 -0.03\" euler=\"1 0 0\""); },
      set("feeler_resolution", "0.0021 0.0021 0.0021"),
      set("feeler_max_cells", "5 5 6"),
      set("feeler_start_offset", "0 0 0.022"),
      set("feeler_workspace", "0.02 0.02 0.022"),
  };
  const std::vector<std::function<void(TaskText&)>> of_task = {
      set("feeler_min_cells", "2 2 3"),
      set("feeler_move_lengths", "1 2"),
      set("feeler_cost", "1 1 0"),
      set("feeler_tolerance_lateral", "0.0004"),
      [](TaskText& t) { t.texts["feeler_goal"] = "insertable"; },
  };
  const Prints base = PrintsOf([](TaskText&) {});
  std::set<std::string> seen = {base.task};
  for (std::size_t i = 0; i < of_map.size(); ++i) {
    const Prints prints = PrintsOf(of_map[i]);
    EXPECT_TRUE(seen.insert(prints.task).second) << i;
    EXPECT_NE(prints.map, base.map) << i;
  }
  for (std::size_t i = 0; i < of_task.size(); ++i) {
    const Prints prints = PrintsOf(of_task[i]);
    EXPECT_TRUE(seen.insert(prints.task).second) << i;
    EXPECT_EQ(prints.map, base.map) << i;
  }
  const Prints open = PrintsOf([](TaskText&) {}, Opening::kOpen);
  EXPECT_TRUE(seen.insert(open.task).second);
  EXPECT_NE(open.map, base.map);
}

TEST(Fingerprint, OfTheOpenMapIgnoresTheLid) {
  const auto other_lid = [](TaskText& t) { Replace(t.target, "0.005 0.005 0.01", "0.005 0.005 0.009"); };
  EXPECT_EQ(PrintsOf(other_lid, Opening::kOpen).task, PrintsOf([](TaskText&) {}, Opening::kOpen).task);
  EXPECT_NE(PrintsOf(other_lid).task, PrintsOf([](TaskText&) {}).task);
}

}  // namespace
}  // namespace feeler::env
