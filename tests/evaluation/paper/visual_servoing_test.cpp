// Statistics of visual servoing from records alone. Laws: rates and medians are those of a count by hand; reasons that
// differ in numbers alone are one; rows differ in task and features alone, so that all have the same episodes.

#include "feeler/evaluation/paper/visual_servoing.h"

#include <gtest/gtest.h>

#include <set>

namespace feeler::evaluation {
namespace {

using nlohmann::json;

TEST(VisualServoingStatistics, CountWhatRecordsSay) {
  std::vector<json> records;
  for (int i = 0; i < 4; ++i) {
    records.push_back({{"inserted", true},
                       {"reason", "inserted"},
                       {"sim_time_s", 2.0 + i},
                       {"pictures", 40 + i},
                       {"error", {{"lateral_m", 3e-4}, {"vertical_m", 4e-4}, {"angle_rad", 0.0}}}});
  }
  for (const char* reason :
       {"policy gave up: features lost: 3 of 7 matches agree", "policy gave up: features lost: 5 of 9 matches agree",
        "servo: the tool touches something"}) {
    records.push_back(
        {{"inserted", false}, {"reason", reason}, {"sim_time_s", 1.0}, {"pictures", 15}, {"error", nullptr}});
  }
  const VisualServoingStatistics s = VisualServoingStatisticsOf(records);
  EXPECT_EQ(s.inserted.successes, 4);
  EXPECT_EQ(s.inserted.trials, 7);
  EXPECT_DOUBLE_EQ(s.time.value, 3.5);
  EXPECT_DOUBLE_EQ(s.pictures_median, 41.5);
  EXPECT_DOUBLE_EQ(s.error.value, 5e-4);
  ASSERT_EQ(s.failures.size(), 2U);
  EXPECT_EQ(s.failures.at("policy gave up: features lost: # of # matches agree"), 2);
  const VisualServoingStatistics none = VisualServoingStatisticsOf({});
  EXPECT_EQ(none.inserted.trials, 0);
  EXPECT_EQ(none.error.value, 0.0);
}

TEST(VisualServoingRows, DifferInLooksAndFeaturesAlone) {
  const std::vector<VisualServoingRow> rows = VisualServoingRows(false);
  std::set<std::string> names;
  for (VisualServoingRow row : rows) {
    EXPECT_GE(row.setting.episodes, 100);
    EXPECT_TRUE(names.insert(row.setting.name).second);
    EXPECT_EQ(row.setting.task.rfind("plug-", 0), 0U);
    EXPECT_FALSE(row.setting.ladder);
    EXPECT_EQ(row.setting.extents, rows.front().setting.extents);
  }
}

}  // namespace
}  // namespace feeler::evaluation
