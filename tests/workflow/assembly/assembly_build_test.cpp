// Checking and building structures. Laws:
//   the assemblies that ship pass every check; parts that overlap at the start or once built, out of reach, or in the
//   way of a port are refused before anything moves, with the insertion named;  a small build ends complete, and again
//   the same for its seed, whatever the number of threads;  errors carry over: what moves an early part moves the true
//   pose of every later port with it, rigidly, and each estimate;  an insertion that cannot succeed ends the build with
//   its reason, and nothing is reported as built that is not;  a database of another task, two of one task and a task
//   without one are refused before any map is loaded;  a problem that no database holds is planned online, and that is
//   said.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "feeler/core/error.h"
#include "feeler/env/contact/contact_map_builder.h"
#include "feeler/env/model/fingerprint.h"
#include "feeler/workflow/assembly/assembly_builds.h"
#include "tests/workflow/assembly/assembly_document.h"

namespace feeler::workflow {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// The first insertions of the crane.
json Beginning(std::size_t insertions) {
  json crane = ShippedAssembly("crane");
  while (crane["insertions"].size() > insertions) {
    crane["insertions"].erase(crane["insertions"].size() - 1);
    crane["parts"].erase(crane["parts"].size() - 1);
  }
  return crane;
}

std::string CheckError(const json& document) {
  try {
    CheckAssembly(LoadAssemblyText(document.dump()));
  } catch (const InputError& error) {
    return error.what();
  }
  return "sound";
}

TEST(AssemblyCheck, ThoseThatShipAreSound) {
  for (const std::string& name : ListAssemblies()) {
    const Assembly assembly = LoadAssembly(name);
    const AssemblyPlan plan = CheckAssembly(assembly);
    EXPECT_EQ(plan.grip_turn_rad.size(), assembly.insertions.size()) << name;
  }
}

TEST(AssemblyCheck, WhatCannotBeBuiltIsRefused) {
  EXPECT_EQ(CheckError(Beginning(1)), "sound");
  json touching = Beginning(2);
  touching["parts"][1]["position_m"] = touching["parts"][0]["position_m"];
  EXPECT_NE(CheckError(touching).find("parts: at the start"), std::string::npos) << CheckError(touching);
  json in_table = Beginning(1);
  in_table["parts"][0]["position_m"][2] = -0.02;
  EXPECT_NE(CheckError(in_table).find("table"), std::string::npos) << CheckError(in_table);
  json in_robot = Beginning(1);
  in_robot["fixtures"][0]["position_m"] = {0.0, 0.0, 0.12};
  EXPECT_NE(CheckError(in_robot).find("the robot"), std::string::npos) << CheckError(in_robot);
  json far = Beginning(1);
  far["fixtures"][0]["position_m"] = {1.15, 0.5, 0.12};
  EXPECT_NE(CheckError(far).find("insertions[0] (mast into base.mouth): inserting: "), std::string::npos)
      << CheckError(far);
  json far_part = Beginning(1);
  far_part["parts"][0]["position_m"] = {1.15, -0.55, 0.004};
  EXPECT_NE(CheckError(far_part).find("fetching: "), std::string::npos) << CheckError(far_part);
  // The arm of the elbow beside the branch of the mast: the jib would meet the branch where its task has nothing.
  json beside = Beginning(3);
  beside["insertions"][1]["turn_deg"] = 0;
  EXPECT_NE(CheckError(beside).find("insertions[2] (jib into head.side): the part meets part mast"), std::string::npos)
      << CheckError(beside);
  // A second base beside the first.
  json crowded = Beginning(1);
  crowded["fixtures"].push_back({{"name", "other"}, {"part", "base"}, {"position_m", {0.65, 0.31, 0.12}}});
  EXPECT_NE(CheckError(crowded).find("insertions[0]"), std::string::npos) << CheckError(crowded);
}

/// The crane's tasks with few hypotheses, so that their maps are small; nothing is planned.
class AssemblyBuild : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    for (const char* name : {"pipe-into-elbow", "elbow-onto-pipe"}) {
      PlanningSetup setup;
      setup.model = env::LoadTask(name);
      for (UncertainAxis& axis : setup.model.task.axes) {
        axis.min_cells = 2;
        axis.max_cells = axis.angular() ? 2 : 3;
      }
      setup.map = std::make_shared<const planner::ContactMap>(
          env::BuildContactMap(setup.model, env::Opening::kClosed, Parallelism(2)));
      (*tasks_)[name] = {std::make_shared<const PlanningSetup>(std::move(setup)), nullptr, nullptr};
    }
  }
  static void TearDownTestSuite() { tasks_->clear(); }

  static AssemblyRecord Build(const Assembly& assembly, const AssemblyOptions& options) {
    return BuildAssembly(assembly, CheckAssembly(assembly), *tasks_, options);
  }

  static std::string Text(const Assembly& assembly, const AssemblyRecord& record) {
    std::string text;
    for (nlohmann::ordered_json line : ToJsonLines(assembly, record)) {
      line.erase("timing");
      text += line.dump() + "\n";
    }
    return text;
  }

  static inline AssemblyTasks* const tasks_ = new AssemblyTasks;
};

TEST_F(AssemblyBuild, EndsCompleteAndAgainTheSame) {
  const Assembly assembly = LoadAssemblyText(Beginning(1).dump());
  const AssemblyPlan plan = CheckAssembly(assembly);
  AssemblyOptions options;
  options.seed = 4;
  std::vector<std::string> texts;
  BuildAssemblies(assembly, plan, *tasks_, options, 2, Parallelism(2),
                  [&](const AssemblyRecord& record) {
                    EXPECT_TRUE(record.complete) << record.reason;
                    EXPECT_EQ(record.steps.size(), 1U);
                    texts.push_back(Text(assembly, record));
                  },
                  {});
  ASSERT_EQ(texts.size(), 2U);
  EXPECT_NE(texts[0], texts[1]);
  options.seed = 5;
  EXPECT_EQ(Text(assembly, BuildAssembly(assembly, plan, *tasks_, options)), texts[1]);
}

TEST_F(AssemblyBuild, PlansOnlineWhatNoDatabaseHolds) {
  const Assembly assembly = LoadAssemblyText(Beginning(1).dump());
  AssemblyTasks tasks = *tasks_;
  tasks["pipe-into-elbow"].online = std::make_shared<execution::OnlinePlanner>();
  const AssemblyRecord record = BuildAssembly(assembly, CheckAssembly(assembly), tasks, {});
  EXPECT_TRUE(record.complete) << record.reason;
  EXPECT_EQ(record.steps[0].attempts[0].policy_source, "online: no database");
  EXPECT_GT(record.steps[0].attempts[0].execution.policy_moves, 0);
}

TEST(AssemblyDatabases, AreThoseOfItsTasks) {
  const Assembly assembly = LoadAssemblyText(Beginning(2).dump());
  const auto database = [](const std::string& name, const std::string& task, const std::string& fingerprint) {
    const std::string path = (fs::path(testing::TempDir()) / name).string();
    fs::remove(path);
    policies::DatabaseIdentity identity;
    identity.task = task;
    identity.fingerprint = fingerprint;
    identity.opening = "closed";
    identity.goal = "singleton";
    policies::Database::Create(path, identity);
    return path;
  };
  const auto error = [&](const std::vector<std::string>& paths) -> std::string {
    try {
      LoadAssemblyTasks(assembly, paths, Parallelism(1));
    } catch (const InputError& caught) {
      return caught.what();
    }
    return "accepted";
  };
  const std::string print = env::Fingerprint(env::LoadTask("pipe-into-elbow"), env::Opening::kClosed);
  const std::string pipe = database("pipe.db", "pipe-into-elbow", print);
  const std::string pipe_too = database("pipe-too.db", "pipe-into-elbow-sideways", print);
  const std::string plug = database("plug.db", "plug", std::string(32, '0'));
  EXPECT_NE(error({pipe, plug}).find("made for task plug"), std::string::npos) << error({pipe, plug});
  EXPECT_NE(error({pipe, pipe_too}).find("a second database of task pipe-into-elbow"), std::string::npos)
      << error({pipe, pipe_too});
  EXPECT_NE(error({pipe}).find("none of the databases is of task elbow-onto-pipe"), std::string::npos) << error({pipe});
  EXPECT_THROW(LoadAssemblyTasks(assembly, {"/no/such.db"}, Parallelism(1)), InputError);
}

TEST_F(AssemblyBuild, ErrorsCarryOver) {
  const Assembly assembly = LoadAssemblyText(Beginning(2).dump());
  AssemblyOptions options;
  options.seed = 3;
  const AssemblyRecord plain = Build(assembly, options);
  ASSERT_TRUE(plain.complete) << plain.reason;
  // What the robot left at a pose ended 2 mm beside it, turned.
  const Pose motion = Eigen::Translation3d(0.65, 0.2, 0.1) *
                      Eigen::AngleAxisd(0.02, Eigen::Vector3d(1, 2, 3).normalized()) *
                      Eigen::Translation3d(-0.648, -0.2, -0.1);
  options.disturb_part = [&](std::size_t insertion, const Pose& pose) { return insertion == 0 ? motion * pose : pose; };
  const AssemblyRecord moved = Build(assembly, options);
  ASSERT_EQ(moved.steps.size(), 2U);
  EXPECT_TRUE(moved.complete) << moved.reason;
  EXPECT_TRUE(moved.steps[0].world_T_true.isApprox(plain.steps[0].world_T_true, 0.0));
  EXPECT_TRUE(moved.steps[1].world_T_true.isApprox(motion * plain.steps[1].world_T_true, 1e-9));
  EXPECT_TRUE(
      moved.steps[1].attempts[0].world_T_estimate.isApprox(motion * plain.steps[1].attempts[0].world_T_estimate, 1e-9));
  EXPECT_GT(moved.steps[1].drawn_error.lateral_m, 0.001);
  // What was built last stands on it.
  EXPECT_LT((moved.steps[1].world_T_part.translation() - (motion * plain.steps[1].world_T_part).translation()).norm(),
            0.002);
}

TEST_F(AssemblyBuild, StopsWhereAnInsertionCannotSucceed) {
  const Assembly assembly = LoadAssemblyText(Beginning(2).dump());
  AssemblyOptions options;
  options.ladder = false;
  const AssemblyPlan plan = CheckAssembly(assembly);
  int calls = 0;
  options.disturb_part = [&](std::size_t, const Pose& pose) {
    ++calls;
    return Pose(Eigen::Translation3d(0.0, 0.0, 3.0) * pose);  // somebody takes the mast away
  };
  const AssemblyRecord record = BuildAssembly(assembly, plan, *tasks_, options);
  EXPECT_EQ(calls, 1);
  EXPECT_FALSE(record.complete);
  ASSERT_EQ(record.steps.size(), 2U);
  EXPECT_TRUE(record.steps[0].inserted);
  EXPECT_FALSE(record.steps[1].inserted);
  EXPECT_NE(record.reason.find("stopped at insertions[1] (head into mast.end): carrying the part"), std::string::npos)
      << record.reason;
  const auto lines = ToJsonLines(assembly, record);
  ASSERT_EQ(lines.size(), 3U);
  EXPECT_EQ(lines.back()["complete"], false);
  EXPECT_EQ(lines.back()["standing"], nlohmann::ordered_json::array({"mast"}));
  EXPECT_TRUE(lines[1]["part_pose"].is_null());
}

TEST_F(AssemblyBuild, AnEstimateFarFromTheTruthEndsItAfterASecondOne) {
  const Assembly assembly = LoadAssemblyText(Beginning(1).dump());
  AssemblyOptions options;
  options.disturb_estimate = [](std::size_t, const Pose& pose) {
    return Pose(Eigen::Translation3d(0.0, 0.03, 0.0) * pose);
  };
  const AssemblyRecord record = Build(assembly, options);
  EXPECT_FALSE(record.complete);
  ASSERT_EQ(record.steps.size(), 1U);
  EXPECT_FALSE(record.steps[0].inserted);
  EXPECT_EQ(record.steps[0].attempts.size(), 2U);
  EXPECT_NE(record.steps[0].attempts[0].extents, planner::Extents());
  EXPECT_NE(record.reason.find("stopped at insertions[0]"), std::string::npos) << record.reason;
  EXPECT_EQ(ToJsonLines(assembly, record).back()["inserted"], 0);
}

}  // namespace
}  // namespace feeler::workflow
