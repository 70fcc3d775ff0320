// The example of docs/environment.md compiles and does what the page says; the page shows this text.

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <string>

// clang-format off
// example begins
#include "feeler/env/gym/insertion_env.h"
#include "feeler/env/gym/spaces.h"
#include "feeler/env/model/task_file.h"
#include "feeler/env/gym/vector_env.h"

using namespace feeler;

double Example() {
  // One model, shared by any number of environments.
  const auto scene = std::make_shared<const env::Scene>(env::BuildScene(env::LoadTask("plug")));

  env::InsertionEnv one(scene);
  env::StepResult result = one.Reset(/*seed=*/11);
  env::GuardedMoveAction down;
  down.motion.direction = -Eigen::Vector3d::UnitZ();
  down.motion.distance_m = 0.06;
  result = one.Step(down);  // ends at the first contact
  const double depth_m = result.observation.travelled_m;

  env::VectorEnvOptions options;
  options.environments = 8;
  options.threads = Parallelism(2);
  env::VectorEnv many(scene, options);
  many.Reset(/*seed=*/11);
  const env::Space space = env::ActionSpace(env::ActionKind::kLowLevel);
  const std::vector<double> nudge = {0, 0, -0.001, 0, 0, 0, 10};  // 1 mm down, 10 ms
  const std::vector<env::Action> actions(8, env::DecodeAction(space, env::ActionKind::kLowLevel, nudge));
  for (int step = 0; step < 5; ++step) many.Step(actions);
  return depth_m + many.observations()[14];  // row 0, component tool.z
}
// example ends
// clang-format on

namespace {

std::string Read(const std::string& path) {
  std::ifstream file(std::string(FEELER_SOURCE_DIR) + path);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(EnvironmentPage, ShowsAnExampleThatRuns) {
  EXPECT_GT(Example(), 0.15);
  std::string source = Read("/tests/env/gym/environment_example_test.cpp");
  source.erase(0, source.find("// example begins\n") + 18);
  source.erase(source.find("// example ends"));
  EXPECT_NE(Read("/docs/environment.md").find("```cpp\n" + source + "```"), std::string::npos);
}

}  // namespace
