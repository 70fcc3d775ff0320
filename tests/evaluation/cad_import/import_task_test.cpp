// Laws of an import from front to back: the folder loads as a task whose pieces have the clearance that was drawn; the
// same input gives the same bytes; what is given on the command line stays when the part is imported again; what was
// mended is stated; the force budget is a number of the task, with its reason, and less for a tip that bears less.
#include "feeler/evaluation/cad_import/import_task.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "feeler/core/error.h"
#include "feeler/env/contact/contact_map_builder.h"
#include "feeler/env/model/task_file.h"
#include "feeler/env/model/task_xml.h"
#include "feeler/evaluation/cad_import/trial.h"
#include "tests/cad/kinds/part_shapes.h"

namespace feeler::evaluation {
namespace {

namespace fs = std::filesystem;

class ImportTaskTest : public testing::Test {
 protected:
  ImportTaskTest()
      : folder_(fs::path(testing::TempDir()) /
                ("import_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()))) {}
  ~ImportTaskTest() override { fs::remove_all(folder_); }

  ImportOptions OptionsFor(const std::string& kind, const std::string& format) {
    const cad::PartFiles files = cad::WriteParts(kind, folder_ / "parts", format);
    ImportOptions options;
    options.tool = files.tool;
    options.target = files.target;
    options.out = folder_ / "task";
    options.uncertainty_m = {0.005, 0.005, 0.004};
    options.uncertainty_source = "as given";
    return options;
  }
  fs::path folder_;
};

TEST_F(ImportTaskTest, LoadsWithTheClearanceThatWasDrawn) {
  const ImportedTask task = ImportTask(OptionsFor("keyed", "step"));
  EXPECT_NEAR(task.pieces_clearance_m.x(), 0.00015, 1e-6);
  EXPECT_NEAR(task.pieces_clearance_m.y(), 0.00015, 1e-6);
  EXPECT_LE(task.target.pieces.size(), 64U);
  const env::TaskModel model = env::LoadTask(task.task_file.string());
  EXPECT_NEAR(model.task.insertion_depth_m, 0.012, 1e-5);
  EXPECT_EQ(model.lid_geoms.size(), 1U);
  EXPECT_GE(task.content.numbers.margin_cells, 0.3);
}

TEST_F(ImportTaskTest, TheStartIsAsFarAsATransferKeepsClear) {
  ImportOptions options = OptionsFor("keyed", "step");
  for (const double cell_m : {0.0008, 0.0015, 0.0016, 0.0018, 0.0019}) {
    options.overrides["feeler_resolution"] = fmt::format("{0} {0} {0}", cell_m);
    const ImportedTask task = ImportTask(options);
    const env::TaskModel model = env::LoadTask(task.task_file.string());
    // Transfers keep clear of targets half a cell beyond the hypotheses, and the lattice lies where the map lays it.
    const planner::ContactMap map = env::BuildContactMap(model, env::Opening::kClosed);
    const double start_m = model.task.start_offset_m.z() + cell_m * map.phase().z();
    const double highest_m = 0.5 * cell_m * task.content.numbers.cells.back();
    EXPECT_GE(start_m - highest_m, 0.004) << cell_m;
    fs::remove_all(options.out);
  }
}

TEST_F(ImportTaskTest, AUnitIsGivenToFilesThatDoNotSay) {
  ImportOptions options = OptionsFor("keyed", "step");
  options.unit = "in";
  const ImportedTask task = ImportTask(options);
  EXPECT_EQ(task.tool.unit, "mm");
  EXPECT_NEAR(task.mating.depth_m, 0.012, 1e-5);
}

TEST(TrialVerdict, SaysWhyNothingWasInserted) {
  Trial trial;
  trial.solved = trial.verified = true;
  TrialRun run{"ideal", "database", {}};
  run.summary.episodes = 30;
  run.summary.failures["transfer to the start pose"] = 30;
  trial.runs.push_back(run);
  EXPECT_FALSE(Works(trial));
  EXPECT_THAT(Verdict({}, trial),
              testing::HasSubstr("ideal: 0 of 30 inserted (failed: 30 x transfer to the start pose)"));
  trial.runs.front().summary.inserted.successes = 1;
  EXPECT_TRUE(Works(trial));
}

TEST_F(ImportTaskTest, SameInputGivesSameBytes) {
  const ImportOptions options = OptionsFor("d-plug", "stl");
  ImportTask(options);
  const std::string xml = env::ReadTextFile(options.out / "task.xml");
  const std::string json = env::ReadTextFile(options.out / "import.json");
  const std::string piece = env::ReadTextFile(options.out / "target_007.stl");
  fs::remove_all(options.out);
  ImportTask(options);
  EXPECT_EQ(env::ReadTextFile(options.out / "task.xml"), xml);
  EXPECT_EQ(env::ReadTextFile(options.out / "import.json"), json);
  EXPECT_EQ(env::ReadTextFile(options.out / "target_007.stl"), piece);
}

TEST_F(ImportTaskTest, OverridesAreKept) {
  ImportOptions options = OptionsFor("rectangle", "step");
  options.overrides["feeler_max_cells"] = "7 7 5";
  ImportTask(options);
  options.overrides.clear();
  const ImportedTask again = ImportTask(options);
  EXPECT_EQ(env::LoadTask(again.task_file.string()).task.axes[2].max_cells, 5);
  options.overrides["feeler_speling"] = "1";
  EXPECT_THROW(ImportTask(options), InputError);
}

// Of a hexagon across an axis no two lines of motion end alike, and yet they end.
TEST_F(ImportTaskTest, SidesThatSlantAreNoFlushPart) {
  const auto speaks_of_flush = testing::Contains(testing::HasSubstr("it is flush there"));
  ImportOptions options = OptionsFor("hex-socket", "stl");
  const ImportedTask task = ImportTask(options);
  EXPECT_FALSE(task.flush_x || task.flush_y);
  EXPECT_THAT(task.notes, testing::Not(speaks_of_flush));
  options = OptionsFor("rectangle", "step");
  options.uncertainty_m = {0.001, 0.001, 0.001};
  options.overrides["feeler_workspace"] = "0.003 0.003 0.015";  // no side is within reach
  const ImportedTask inner = ImportTask(options);
  EXPECT_TRUE(inner.flush_x && inner.flush_y);
  EXPECT_THAT(inner.notes, speaks_of_flush);
}

/// Turns every triangle of a binary STL inside out.
void TurnInsideOut(const std::string& file) {
  std::string bytes = env::ReadTextFile(file);
  constexpr std::size_t kHeader = 84;
  constexpr std::size_t kTriangle = 50;
  constexpr std::size_t kCorner = 12;
  for (std::size_t at = kHeader; at + kTriangle <= bytes.size(); at += kTriangle) {
    std::swap_ranges(bytes.begin() + static_cast<std::ptrdiff_t>(at + kCorner),
                     bytes.begin() + static_cast<std::ptrdiff_t>(at + 2 * kCorner),
                     bytes.begin() + static_cast<std::ptrdiff_t>(at + 2 * kCorner));
  }
  std::ofstream(file, std::ios::binary) << bytes;
}

/// Makes the part of a binary STL thinner along x, about the origin.
void Thin(const std::string& file, float factor) {
  std::string bytes = env::ReadTextFile(file);
  constexpr std::size_t kHeader = 84;
  constexpr std::size_t kTriangle = 50;
  for (std::size_t at = kHeader; at + kTriangle <= bytes.size(); at += kTriangle) {
    for (std::size_t corner = 1; corner <= 3; ++corner) {
      float x = 0.0F;
      std::memcpy(&x, bytes.data() + at + 12 * corner, sizeof x);
      x *= factor;
      std::memcpy(bytes.data() + at + 12 * corner, &x, sizeof x);
    }
  }
  std::ofstream(file, std::ios::binary) << bytes;
}

TEST_F(ImportTaskTest, ToleratesAlongEachAxisWhatEntersThere) {
  ImportOptions options = OptionsFor("rectangle", "stl");
  const ImportedTask as_drawn = ImportTask(options);
  const Tolerance drawn = env::LoadTask(as_drawn.task_file.string()).task.tolerance;
  Thin(options.tool, 0.97F);
  const ImportedTask thinned = ImportTask(options);
  const Tolerance thin = env::LoadTask(thinned.task_file.string()).task.tolerance;
  const Eigen::Vector2d enters_m = thinned.mating.clearance_m + thinned.mating.lead_in_m;
  const Eigen::Vector2d gained_m = enters_m - as_drawn.mating.clearance_m - as_drawn.mating.lead_in_m;
  EXPECT_GT(gained_m.maxCoeff(), 5e-5);
  EXPECT_NEAR(gained_m.minCoeff(), 0.0, 2e-6) << "along one axis alone";
  // A rectangle enters at the corners of what enters along each axis.
  for (const int axis : {0, 1}) {
    EXPECT_NEAR(thin.Lateral(axis), 0.95 * enters_m[axis], 4e-6) << axis;
    EXPECT_GE(thin.Lateral(axis), drawn.Lateral(axis) - 4e-6) << axis;
  }
}

TEST_F(ImportTaskTest, StatesWhatWasMendedAndTheForceBudget) {
  ImportOptions options = OptionsFor("rectangle", "stl");
  TurnInsideOut(options.tool);
  const auto budget = [](const ImportedTask& task) {
    const auto& fields = task.content.numbers.fields;
    return *std::find_if(fields.begin(), fields.end(), [](const auto& f) { return f.field == "feeler_force_budget"; });
  };
  const ImportedTask task = ImportTask(options);
  EXPECT_THAT(task.notes, testing::Contains(testing::AllOf(testing::HasSubstr("tool"), testing::HasSubstr("mended"),
                                                           testing::HasSubstr("turned"))));
  EXPECT_THAT(
      task.notes,
      testing::Not(testing::Contains(testing::AllOf(testing::HasSubstr("target ("), testing::HasSubstr("mended")))));
  EXPECT_EQ(env::LoadTask(task.task_file.string()).task.force_budget_n, 25.0);
  EXPECT_THAT(budget(task).reason, testing::HasSubstr("abs yields"));
}

}  // namespace
}  // namespace feeler::evaluation
