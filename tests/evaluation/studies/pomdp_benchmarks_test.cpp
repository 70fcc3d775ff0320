// Laws of the benchmarks of general POMDPs: an interval holds the value that is known by hand, and RTDP-Bel's exact
// value lies below its upper end; a second run measures nothing again; a model of a folder takes the place of ours of
// the same name; what is no folder of models is refused.
#include "feeler/evaluation/studies/pomdp_benchmarks.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "feeler/core/error.h"
#include "feeler/planner/pomdp/files/pomdp_file.h"

namespace feeler::evaluation {
namespace {

namespace fs = std::filesystem;

class PomdpBenchmarks : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = testing::TempDir() + "/feeler_pomdp_" + testing::UnitTest::GetInstance()->current_test_info()->name();
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  ExperimentRequest Request() const {
    ExperimentRequest request;
    request.out = folder_;
    request.jobs = Parallelism(1);
    return request;
  }
  std::string folder_;
};

// One step to the goal with certainty 1/2: V = -1 - gamma / 2 - gamma^2 / 4 - ... = -1 / (1 - gamma / 2).
constexpr const char* kCoin = R"(discount: 0.9
values: reward
states: here goal
actions: try
observations: nothing
start: 1 0
T: try : here : here 0.5
T: try : here : goal 0.5
T: try : goal : goal 1
O: * : * : nothing 1
R: try : here : * : * -1
)";

TEST_F(PomdpBenchmarks, IntervalsHoldTheValueAndRunsAreKept) {
  const std::vector<planner::Pomdp> models = {planner::ParseCassandraPomdp(kCoin, "Coin")};
  PomdpBenchmarksProtocol protocol;
  protocol.episodes = 2000;
  const ExperimentResult result = RunPomdpBenchmarksOn(models, protocol, Request());
  ASSERT_TRUE(result.complete);
  const auto column = [&](const std::string& name) {
    const auto at = std::ranges::find(result.table.columns, name);
    return result.table.rows.at(0).at(static_cast<std::size_t>(at - result.table.columns.begin()));
  };
  const double value = -1.0 / (1.0 - 0.45);
  EXPECT_LE(column("lower").get<double>(), value + 1e-6);
  EXPECT_GE(column("upper").get<double>(), value - 1e-6);
  EXPECT_LE(column("width").get<double>(), 2e-3);
  EXPECT_NEAR(column("rtdp_value").get<double>(), value, 1e-6);
  EXPECT_NEAR(column("rtdp_mean").get<double>(), value, 3.0 * column("rtdp_half_width").get<double>());
  EXPECT_TRUE(column("sarsop_lower").is_null());
  // The same again, with the measured times of the first run.
  const ExperimentResult again = RunPomdpBenchmarksOn(models, protocol, Request());
  EXPECT_EQ(again.table.rows, result.table.rows);
  protocol.levels = 7;
  EXPECT_THROW(RunPomdpBenchmarksOn(models, protocol, Request()), InputError) << "other settings";
}

TEST_F(PomdpBenchmarks, TakesModelsOfAFolder) {
  ExperimentRequest request = Request();
  request.quick = true;
  request.pomdps = folder_ + "/none";
  EXPECT_THROW(RunPomdpBenchmarks(request), InputError);
  request.pomdps = folder_;
  EXPECT_THROW(RunPomdpBenchmarks(request), InputError) << "no model in it";
  for (const char* name : {"Tiger", "RockSample_4_4"}) std::ofstream(folder_ + "/" + name + ".pomdp") << kCoin;
  const ExperimentResult result = RunPomdpBenchmarks(request);
  ASSERT_EQ(result.table.rows.size(), 2U);
  for (const auto& row : result.table.rows) EXPECT_EQ(row[1], 2) << row[0] << ": states of the folder's";
}

}  // namespace
}  // namespace feeler::evaluation
