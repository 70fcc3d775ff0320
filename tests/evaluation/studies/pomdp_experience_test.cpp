// Laws of experience on general problems: with a problem's own policy as experience no more is expanded than without,
// and the controller is worth no less than the inflation allows; a second run measures nothing again.
#include "feeler/evaluation/studies/pomdp_experience.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "feeler/planner/pomdp/model/rock_sample.h"

namespace feeler::evaluation {
namespace {

namespace fs = std::filesystem;

TEST(PomdpExperience, TheOwnPolicySavesExpansions) {
  const std::string folder = testing::TempDir() + "/feeler_pomdp_experience";
  fs::remove_all(folder);
  fs::create_directories(folder);
  const planner::Pomdp pomdp = planner::MakeRockSample(planner::DrawRockSample(3, 2, 2));
  ExperimentRequest request;
  request.out = folder;
  request.jobs = Parallelism(1);
  PomdpExperienceProtocol protocol;
  protocol.levels = 7;
  protocol.expansion_limit = 20'000;
  const std::vector<PomdpFamily> families = {{"rocks", {pomdp, pomdp}, {1.1}}};
  const ExperimentResult result = RunPomdpExperienceOn(families, protocol, request);
  ASSERT_TRUE(result.complete);
  ASSERT_EQ(result.table.rows.size(), 1U);
  const auto column = [&](const std::string& name) {
    const auto at = std::ranges::find(result.table.columns, name);
    return result.table.rows[0].at(static_cast<std::size_t>(at - result.table.columns.begin())).get<double>();
  };
  EXPECT_EQ(column("converged"), 1.0);
  EXPECT_LE(column("expansions"), column("expansions_none"));
  EXPECT_GE(column("value_experience"), column("value_none") - 1.0);
  const ExperimentResult again = RunPomdpExperienceOn(families, protocol, request);
  EXPECT_EQ(again.table.rows, result.table.rows) << "measured CPU times and all: nothing is measured again";
}

}  // namespace
}  // namespace feeler::evaluation
