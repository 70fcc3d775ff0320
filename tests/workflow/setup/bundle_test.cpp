// The bundle beside a database. Laws: what is read is what was written (numbers bit for bit, the map cell for cell, the
// travel from the pieces that of the task's own geoms, with the opening as it is); a flipped byte anywhere, a cut file
// and a newer version are refused in words; a bundle of another task does not serve a database.

#include "feeler/workflow/setup/bundle.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "feeler/core/error.h"
#include "feeler/env/model/task_pieces.h"
#include "feeler/planner/contact/contact_map_file.h"
#include "feeler/workflow/setup/database_builder.h"

namespace feeler::workflow {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

std::string Bytes(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void WriteBytes(const std::string& path, const std::string& bytes) { std::ofstream(path, std::ios::binary) << bytes; }

std::string ErrorOf(const std::string& path) {
  try {
    policies::ReadBundle(path);
    return "read";
  } catch (const InputError& error) {
    return error.what();
  }
}

class Bundle : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) / ("bundle_test_" + std::to_string(::getpid()));  // tests run side by side
    fs::create_directories(folder_);
    path_ = (folder_ / "plug.db.bundle").string();
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path folder_;
  std::string path_;
};

TEST_F(Bundle, HoldsWhatWasWritten) {
  for (const char* name : {"plug", "round-peg"}) {
    const PlanningSetup setup = LoadPlanningSetup(name);
    policies::WriteBundle(path_, BundleOf(setup));
    const policies::TaskBundle bundle = policies::ReadBundle(path_);
    const Task& task = setup.task();
    EXPECT_EQ(bundle.fingerprint, setup.fingerprint);
    EXPECT_EQ(bundle.opening, "closed");
    EXPECT_EQ(bundle.task.name, task.name);
    ASSERT_EQ(bundle.task.axes.size(), task.axes.size());
    for (std::size_t i = 0; i < task.axes.size(); ++i) {
      EXPECT_EQ(bundle.task.axes[i].kind, task.axes[i].kind);
      EXPECT_EQ(bundle.task.axes[i].resolution, task.axes[i].resolution);
      EXPECT_EQ(bundle.task.axes[i].min_cells, task.axes[i].min_cells);
      EXPECT_EQ(bundle.task.axes[i].max_cells, task.axes[i].max_cells);
    }
    EXPECT_EQ(bundle.task.cell_m, task.cell_m);
    EXPECT_EQ(bundle.task.start_offset_m, task.start_offset_m);
    EXPECT_EQ(bundle.task.insertion, task.insertion);
    EXPECT_EQ(bundle.task.insertion_depth_m, task.insertion_depth_m);
    EXPECT_EQ(bundle.task.tolerance.lateral_m, task.tolerance.lateral_m);
    EXPECT_EQ(bundle.task.tolerance.vertical_m, task.tolerance.vertical_m);
    EXPECT_EQ(bundle.task.tolerance.angle_rad, task.tolerance.angle_rad);
    EXPECT_EQ(bundle.task.cost, task.cost);
    EXPECT_EQ(bundle.task.times, task.times);
    EXPECT_EQ(bundle.task.goal, task.goal);
    EXPECT_EQ(bundle.task.move_lengths, task.move_lengths);
    EXPECT_EQ(bundle.task.workspace_m, task.workspace_m);
    EXPECT_EQ(bundle.task.workspace_center_m, task.workspace_center_m);
    EXPECT_EQ(bundle.task.turns_freely, task.turns_freely);
    EXPECT_EQ(bundle.task.world_T_target.matrix(), task.world_T_target.matrix());
    EXPECT_EQ(bundle.task.flange_T_tool.matrix(), task.flange_T_tool.matrix());
    EXPECT_EQ(planner::EncodeContactMap(*bundle.map), planner::EncodeContactMap(*setup.map));
    EXPECT_EQ(bundle.lids.size(), setup.model.lid_geoms.size());

    const auto own = env::MakeExactTravel(setup.model, env::Opening::kOpen);
    const auto read = policies::TravelModelOf(bundle);
    std::vector<planner::ToolMotion> motions;
    for (int x = -6; x <= 6; ++x) {
      for (int y = -6; y <= 6; ++y) {
        for (const Direction d : kDirections) motions.push_back({{0.0031 * x, 0.0029 * y, 0.003}, d});
      }
    }
    const Pose target = MakePose({0.0007, -0.0004, 0.0}, 0.02);
    EXPECT_EQ(own->Travel(target, motions), read->Travel(target, motions));
  }
}

TEST_F(Bundle, RefusesDamage) {
  policies::WriteBundle(path_, BundleOf(LoadPlanningSetup("plug")));
  const std::string bytes = Bytes(path_);
  for (std::size_t k = 0; k < 40; ++k) {
    std::string broken = bytes;
    broken[k * (bytes.size() - 1) / 39] ^= 0x10;
    WriteBytes(path_, broken);
    EXPECT_THAT(ErrorOf(path_), HasSubstr("bundle")) << "byte " << k * (bytes.size() - 1) / 39;
    WriteBytes(path_, bytes.substr(0, k * bytes.size() / 40));
    EXPECT_THAT(ErrorOf(path_), HasSubstr("bundle")) << "cut to " << k << "/40";
  }
  std::string newer = bytes;
  newer[8] = 2;
  WriteBytes(path_, newer);
  EXPECT_THAT(ErrorOf(path_), HasSubstr("version 2"));
  fs::remove(path_);
  EXPECT_THAT(ErrorOf(path_), HasSubstr("feeler db bundle"));
}

TEST_F(Bundle, LiesBesideItsDatabaseAndServesNoOther) {
  const PlanningSetup plug = LoadPlanningSetup("plug");
  const std::string database = (folder_ / "plug.db").string();
  BuildDatabase(plug, planner::ParseProblemFamily("2x2x2", plug.task()), {}, database);
  EXPECT_EQ(policies::ReadBundleOf(policies::Database::OpenReadOnly(database)).fingerprint, plug.fingerprint);
  policies::WriteBundle(path_, BundleOf(LoadPlanningSetup("round-peg")));
  EXPECT_THROW(policies::ReadBundleOf(policies::Database::OpenReadOnly(database)), InputError);
  KeepBundle(plug, database);
  EXPECT_EQ(policies::ReadBundleOf(policies::Database::OpenReadOnly(database)).fingerprint, plug.fingerprint);
}

}  // namespace
}  // namespace feeler::workflow
