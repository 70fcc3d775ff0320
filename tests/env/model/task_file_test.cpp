// Task files. Laws:
//   what the file says is what the task holds;  the resolved text stands alone and compiles to the same geometry;
//   each way to spoil a valid file is one InputError, on one line, that names the file and the field;
//   the plug's opening lets 1 mm of lateral error in and keeps 2 mm out.

#include "feeler/env/model/task_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>

#include "feeler/core/error.h"
#include "feeler/env/model/mujoco_handles.h"
#include "feeler/env/model/overlap_judge.h"
#include "feeler/env/model/task_xml.h"
#include "tests/env/task_text.h"

namespace feeler::env {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

std::string ErrorOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const InputError& error) {
    EXPECT_TRUE(std::string(error.what()).ends_with(')')) << "says not how to mend it: " << error.what();
    return error.what();
  }
  return "no error";
}
std::string ErrorOf(const TaskText& text) {
  return ErrorOf([&] { LoadTaskFromText(text.Mjcf(), "peg.xml"); });
}

class FolderTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("feeler_task_test_" + std::to_string(::getpid()) + "_" +
                                           ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path Write(const std::string& name, const std::string& text) {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }
  fs::path folder_;
};
using TaskFolder = FolderTest;

TEST(TaskFile, PlugHoldsWhatItsFileSays) {
  const TaskModel plug = LoadTask("plug");
  const Task& task = plug.task;
  EXPECT_EQ(task.name, "plug");
  EXPECT_EQ(task.file, std::string(FEELER_SOURCE_DIR) + "/models/tasks/plug.xml");
  ASSERT_EQ(task.axes.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(static_cast<std::size_t>(task.axes[i].kind), i);
    EXPECT_EQ(task.axes[i].resolution, 0.002);
    EXPECT_EQ(task.axes[i].min_cells, 2);
    EXPECT_EQ(task.axes[i].max_cells, 15);
  }
  EXPECT_EQ(task.cell_m, 0.002);
  EXPECT_EQ(task.start_offset_m, Eigen::Vector3d(0, 0, 0.024));
  EXPECT_EQ(task.insertion, Direction::kMinusZ);
  EXPECT_EQ(task.tolerance.lateral_m, 0.001);
  EXPECT_EQ(task.goal, GoalKind::kSingleton);
  EXPECT_EQ(task.cost, (CostWeights{1, 0, 0}));
  EXPECT_THAT(task.move_lengths, ElementsAre(1, 2, 4, 8, 16));
  EXPECT_TRUE(task.world_T_target.translation().isApprox(Eigen::Vector3d(0.65, 0, 0.2)));
  EXPECT_EQ(plug.lid_geoms.size(), 1U);
  EXPECT_EQ(LargestPositionExtents(task), Cell(15, 15, 15));
  EXPECT_EQ(StartCell(task, {15, 15, 15}), Cell(7, 7, 19));
  EXPECT_EQ(StartCell(task, {2, 3, 4}), Cell(0, 1, 13));
}

TEST(TaskFile, NamesAndPathsLeadToTheSameTask) {
  EXPECT_THAT(ListTasks(), Contains("plug"));
  EXPECT_EQ(LoadTask(std::string(FEELER_SOURCE_DIR) + "/models/tasks/plug.xml").xml, LoadTask("plug").xml);
}

TEST(TaskFile, ResolvedTextStandsAlone) {
  const TaskModel plug = LoadTask("plug");
  EXPECT_THAT(plug.xml, Not(HasSubstr("<include")));
  const ModelHandle again = CompileMjcf(plug.xml, "again");
  EXPECT_EQ(again->ngeom, plug.model->ngeom);
  EXPECT_EQ(again->nmesh, plug.model->nmesh);
}

TEST(TaskFile, PlugOpensInMujocoAsItIs) {
  // As a viewer reads it: from the file, includes and all.
  RouteMujocoMessages();
  std::array<char, 1000> message{};
  const ModelHandle model(mj_loadXML((std::string(FEELER_SOURCE_DIR) + "/models/tasks/plug.xml").c_str(), nullptr,
                                     message.data(), static_cast<int>(message.size())));
  ASSERT_TRUE(model) << message.data();
  EXPECT_EQ(message[0], '\0');
}

TEST(TaskFile, PlugLetsOneMillimetreInAndKeepsTwoOut) {
  const TaskModel plug = LoadTask("plug");
  OverlapJudge open(plug, plug.target_geoms);
  const auto overlaps_at = [&](double lateral_m, double depth_m) {
    int overlaps = 0;
    for (const int k : {0, 1, 2, 3, 5, 6, 7, 8}) {
      overlaps += open.Overlap({(k % 3 - 1) * lateral_m, (k / 3 - 1) * lateral_m, -depth_m}) ? 1 : 0;
    }
    return overlaps;
  };
  EXPECT_EQ(overlaps_at(0.001, 0.00005), 0);
  EXPECT_EQ(overlaps_at(0.002, 0.00005), 8);
  EXPECT_EQ(overlaps_at(0.0003, 0.018), 0);
  EXPECT_EQ(overlaps_at(0.0008, 0.018), 8);
  EXPECT_FALSE(open.Overlap({0, 0, -0.0199}));
  EXPECT_TRUE(open.Overlap({0, 0, -0.0201}));
}

TEST(TaskFile, AngularAxesHaveTheirOwnResolution) {
  TaskText text;
  text.texts["feeler_axes"] = "x y yaw";
  text.numbers["feeler_resolution"] = "0.002 0.002 0.05";
  const Task task = LoadTaskFromText(text.Mjcf(), "peg.xml").task;
  EXPECT_EQ(task.axes[2].kind, AxisKind::kYaw);
  EXPECT_EQ(task.axes[2].resolution, 0.05);
  EXPECT_EQ(task.cell_m, 0.002);
  EXPECT_EQ(LargestPositionExtents(task), Cell(5, 5, 1));
}

TEST(TaskFile, TheExampleOfTheDocumentationLoads) {
  const std::string page = ReadTextFile(fs::path(FEELER_SOURCE_DIR) / "docs/task-file.md");
  const auto begin = page.find("```xml\n") + 7;
  const TaskModel example = LoadTaskFromText(page.substr(begin, page.find("```", begin) - begin), "peg.xml");
  EXPECT_EQ(example.lid_geoms.size(), 1U);
  // Each field of a task is explained.
  for (const auto& [field, value] : TaskText().numbers) EXPECT_THAT(page, HasSubstr("`" + field + "`"));
  for (const auto& [field, value] : TaskText().texts) EXPECT_THAT(page, HasSubstr("`" + field + "`"));
}

TEST(TaskFile, DefaultTextIsValid) { EXPECT_EQ(ErrorOf(TaskText()), "no error"); }

TEST(TaskFile, EveryMissingFieldIsNamed) {
  for (const auto& [field, value] : TaskText().numbers) {
    if (field.starts_with("feeler_tolerance")) continue;  // derived: mouth_clearance_test.cpp
    TaskText text;
    text.numbers.erase(field);
    EXPECT_THAT(ErrorOf(text), AllOf(HasSubstr("peg.xml: <custom><numeric name=\"" + field), HasSubstr("is missing")));
  }
  for (const auto& [field, value] : TaskText().texts) {
    TaskText text;
    text.texts.erase(field);
    EXPECT_THAT(ErrorOf(text), AllOf(HasSubstr("peg.xml: <custom><text name=\"" + field), HasSubstr("is missing")));
  }
}

struct BadField {
  std::string field;
  std::string value;
  std::string expected;
};

TEST(TaskFile, EveryBadNumberIsNamed) {
  const std::vector<BadField> cases = {
      {"feeler_resolution", "0.002 0.002", "has 2 values instead of 3"},
      {"feeler_resolution", "0 0 0", "not positive"},
      {"feeler_resolution", "-0.002 -0.002 -0.002", "not positive"},
      {"feeler_resolution", "0.002 0.002 0.003", "share one lattice"},
      {"feeler_resolution", "2 2 2", "absurdly coarse"},
      {"feeler_resolution", "1e-7 1e-7 1e-7", "finer than"},
      {"feeler_resolution", "nan 0.002 0.002", ""},
      {"feeler_resolution", "inf 0.002 0.002", ""},
      {"feeler_min_cells", "6 2 2", "exceeds feeler_max_cells"},
      {"feeler_min_cells", "0 2 2", "is not in 1 to"},
      {"feeler_min_cells", "2.5 2 2", "not a whole number"},
      {"feeler_max_cells", "5 5 5000", "is not in 1 to"},
      {"feeler_start_offset", "0 0", "has 2 values instead of 3"},
      {"feeler_start_offset", "0 0 50", "is not in"},
      {"feeler_start_offset", "0 0 0.002", "starts in collision"},
      {"feeler_workspace", "-0.02 0.02 0.02", "is not in"},
      {"feeler_workspace", "0.001 0.02 0.02", "no room along the uncertain axis x"},
      {"feeler_move_lengths", "1 2 2", "twice"},
      {"feeler_move_lengths", "2 4", "does not contain 1"},
      {"feeler_move_lengths", "0 1", "is not in"},
      {"feeler_insertion_depth", "-0.01", "is not in"},
      {"feeler_insertion_depth", "0", "is zero"},
      {"feeler_tolerance_lateral", "0.003", "misses the opening"},
      {"feeler_tolerance_lateral", "0", "is zero"},
      {"feeler_tolerance_lateral", "0.0005 0", "is zero"},
      {"feeler_tolerance_lateral", "0.0005 0.003", "misses the opening"},
      {"feeler_tolerance_lateral", "0.0005 0.0005 0.0005", "has 3 values instead of 1 or 2"},
      {"feeler_tolerance_lateral", "nan", ""},
      {"feeler_tolerance_angle", "0.03 0.03", "has 2 values instead of 1 or 3"},
      {"feeler_tolerance_vertical", "0.02", "not below feeler_insertion_depth"},
      {"feeler_tolerance_angle", "-0.03", "is not in"},
      {"feeler_cost", "-1 0 0", "is not in"},
      {"feeler_cost", "0 1 0", "must cost something"},
      {"feeler_cost", "1 0", "has 2 values instead of 3"},
      {"feeler_flange_quaternion", "1 1 0 0", "length"},
      {"feeler_cell", "0.003", "contradicts"},
      {"feeler_resolutoin", "1", "is not a field of a task"},
  };
  for (const BadField& bad : cases) {
    TaskText text;
    text.numbers[bad.field] = bad.value;
    const std::string error = ErrorOf(text);
    EXPECT_THAT(error, AllOf(HasSubstr("peg.xml"), HasSubstr(bad.expected), Not(HasSubstr("\n")), Not("no error")))
        << bad.field << " = " << bad.value;
    if (!bad.expected.empty()) {
      EXPECT_THAT(error, HasSubstr(bad.field));
    }
  }
}

TEST(TaskFile, EveryBadTextIsNamed) {
  const std::vector<BadField> cases = {
      {"feeler_axes", "x y roll", "unknown axis 'roll'"},
      {"feeler_axes", "x x z", "repeated or out of order"},
      {"feeler_axes", "z y x", "repeated or out of order"},
      {"feeler_axes", " ", "names no axis"},
      {"feeler_insertion_axis", "down", "'down' is not a direction"},
      {"feeler_goal", "win", "unknown goal 'win'"},
      {"feeler_colour", "red", "is not a field of a task"},
  };
  for (const BadField& bad : cases) {
    TaskText text;
    text.texts[bad.field] = bad.value;
    EXPECT_THAT(ErrorOf(text), AllOf(HasSubstr("peg.xml: <custom><text name=\"" + bad.field), HasSubstr(bad.expected)));
  }
}

TEST(TaskFile, BadBodiesAndGeomsAreNamed) {
  const auto error = [](const std::function<void(TaskText&)>& spoil) {
    TaskText text;
    spoil(text);
    return ErrorOf(text);
  };
  EXPECT_THAT(error([](TaskText& t) { t.tool_body = ""; }), HasSubstr("<body name=\"tool\"> is missing"));
  EXPECT_THAT(error([](TaskText& t) { t.target_body = ""; }), HasSubstr("<body name=\"target\"> is missing"));
  EXPECT_THAT(error([](TaskText& t) { t.tool = ""; }), HasSubstr("has no geom that can collide"));
  EXPECT_THAT(error([](TaskText& t) { t.tool_body = "<body name=\"arm\"><body name=\"tool\">", t.tool += "</body>"; }),
              HasSubstr("is not a child of <worldbody>"));
  EXPECT_THAT(error([](TaskText& t) { t.target += "<geom name=\"lid2\" size=\"0.001\"/>"; }),
              HasSubstr("a lid collides in physics"));
  EXPECT_THAT(error([](TaskText& t) { t.tool += "<geom type=\"plane\" size=\"1 1 1\"/>"; }),
              HasSubstr("cannot have a plane"));
  EXPECT_THAT(error([](TaskText& t) { t.tool = "<geom type=\"box\" size=\"0.006 0.004 0.01\" pos=\"0 0 0.01\"/>"; }),
              HasSubstr("meets the target"));
}

TEST(TaskFile, MalformedXmlIsOneLine) {
  for (const std::string& text :
       {std::string("<mujoco><custom>"), std::string("not xml"), std::string(), std::string("<robot/>"),
        std::string("<mujoco><worldbody><geom type=\"blob\"/></worldbody></mujoco>"),
        std::string("<mujoco><worldbody><body name=\"tool\"/><body name=\"tool\"/></worldbody></mujoco>"),
        std::string("\0\1\2<mujoco>", 11), TaskText().Mjcf().substr(0, 700)}) {
    const std::string error = ErrorOf([&] { LoadTaskFromText(text, "broken.xml"); });
    EXPECT_THAT(error, AllOf(HasSubstr("broken.xml"), Not(HasSubstr("\n")))) << text;
  }
}

TEST(TaskFile, UnknownTaskListsTheKnownOnes) {
  EXPECT_THAT(ErrorOf([] { LoadTask("plugg"); }),
              AllOf(HasSubstr("plugg"), HasSubstr("no such task"), HasSubstr("plug")));
  EXPECT_THAT(ErrorOf([] { LoadTask("/nowhere/plug.xml"); }), HasSubstr("/nowhere/plug.xml"));
  EXPECT_THAT(ErrorOf([] { LoadTask(""); }), HasSubstr("no such task"));
  EXPECT_THAT(ErrorOf([] { LoadTask("/"); }), HasSubstr("no such task"));
}

TEST_F(TaskFolder, ModelsFolderCanBeElsewhere) {
  Write("tasks/peg.xml", TaskText().Mjcf());
  ::setenv("FEELER_MODELS", folder_.c_str(), 1);
  const auto names = ListTasks();
  const TaskModel peg = LoadTask("peg");
  ::unsetenv("FEELER_MODELS");
  EXPECT_THAT(names, ElementsAre("peg"));
  EXPECT_EQ(peg.task.name, "peg");
}

TEST_F(TaskFolder, FilesNamedTaskAreCalledAsTheirModel) {
  const auto name_of = [&](const std::string& file, const std::string& model) {
    std::string text = TaskText().Mjcf();
    const std::size_t at = text.find("<mujoco");
    const std::size_t end = text.find('>', at);
    text.replace(at, end - at + 1, "<mujoco" + (model.empty() ? "" : " model=\"" + model + "\"") + ">");
    return LoadTask(Write(file, text)).task.name;
  };
  EXPECT_EQ(name_of("rect/task.xml", "rect-8.tight"), "rect-8.tight");
  EXPECT_EQ(name_of("rect/other.xml", "rect-8.tight"), "other");
  EXPECT_EQ(name_of("rect/task.xml", ""), "task");
  for (const char* odd : {"../up", "a b", "MuJoCo Model", ".hidden"}) EXPECT_EQ(name_of("rect/task.xml", odd), "task");
}

TEST_F(TaskFolder, IncludesAreRelativeToTheMainFile) {
  TaskText text;
  Write("parts/peg.xml", "<mujoco>" + text.tool + "</mujoco>");
  text.tool = "<include file=\"../parts/peg.xml\"/>";
  EXPECT_EQ(LoadTask(Write("tasks/peg.xml", text.Mjcf())).tool_geoms.size(), 1U);

  text.tool += text.tool;
  EXPECT_THAT(ErrorOf([&] { LoadTask(Write("tasks/twice.xml", text.Mjcf())); }), HasSubstr("included twice"));
  text.tool = "<include file=\"absent.xml\"/>";
  EXPECT_THAT(ErrorOf([&] { LoadTask(Write("tasks/absent_part.xml", text.Mjcf())); }), HasSubstr("no file"));
  text.tool = "<include/>";
  EXPECT_THAT(ErrorOf([&] { LoadTask(Write("tasks/no_name.xml", text.Mjcf())); }), HasSubstr("file is missing"));
  Write("parts/loop.xml", "<mujoco><include file=\"../parts/loop.xml\"/></mujoco>");
  text.tool = "<include file=\"../parts/loop.xml\"/>";
  EXPECT_THAT(ErrorOf([&] { LoadTask(Write("tasks/loop.xml", text.Mjcf())); }), HasSubstr("included twice"));
  Write("parts/bad.xml", "<mujoco><geom");
  text.tool = "<include file=\"../parts/bad.xml\"/>";
  EXPECT_THAT(ErrorOf([&] { LoadTask(Write("tasks/bad.xml", text.Mjcf())); }),
              HasSubstr("parts/bad.xml: malformed XML"));
}

TEST_F(TaskFolder, MeshFilesAreFoundBesideTheTask) {
  // A cube of 8 mm as an ASCII Wavefront file.
  std::string obj;
  for (int i = 0; i < 8; ++i) {
    obj += "v " + std::string(i & 1 ? "0.004" : "-0.004") + (i & 2 ? " 0.004" : " -0.004") + (i & 4 ? " 0.03" : " 0") +
           "\n";
  }
  obj += "f 1 3 4\nf 1 4 2\nf 5 6 8\nf 5 8 7\nf 1 2 6\nf 1 6 5\nf 3 7 8\nf 3 8 4\nf 1 5 7\nf 1 7 3\nf 2 4 8\nf 2 8 6\n";
  Write("tasks/meshes/peg.obj", obj);
  TaskText text;
  text.extra = R"(<compiler meshdir="meshes"/><asset><mesh name="peg" file="peg.obj"/></asset>)";
  text.tool = R"(<geom type="mesh" mesh="peg"/>)";
  const TaskModel task_model = LoadTask(Write("tasks/peg.xml", text.Mjcf()));
  EXPECT_EQ(task_model.model->nmesh, 1);
  EXPECT_THAT(task_model.xml, HasSubstr((folder_ / "tasks/meshes/peg.obj").string()));
}

}  // namespace
}  // namespace feeler::env
