// step_environment [TASK]: steps the simulated world once down to the first contact.
#include <cstdio>
#include <exception>
#include <memory>

#include "feeler/core/data_folder.h"
#include "feeler/env/gym/insertion_env.h"
#include "feeler/env/model/task_file.h"

using namespace feeler;

int main(int argc, char** argv) {
  try {
    SetDataFolder(FEELER_DATA);
    const auto scene = std::make_shared<const env::Scene>(env::BuildScene(env::LoadTask(argc > 1 ? argv[1] : "plug")));
    env::InsertionEnv environment(scene);
    environment.Reset(/*seed=*/11);
    env::GuardedMoveAction down;
    down.motion.direction = -Eigen::Vector3d::UnitZ();
    down.motion.distance_m = 0.06;
    const env::StepResult result = environment.Step(down);
    std::printf("travelled %.2f mm until contact\n", 1e3 * result.observation.travelled_m);
    return result.observation.travelled_m > 0.0 ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "step_environment: error: %s\n", error.what());
    return 2;
  }
}
