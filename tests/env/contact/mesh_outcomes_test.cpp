// Law: outcomes by collision checks of the meshes are those of the contact map, which sweeps whole lines; they may
// differ where something thinner than the distance between two checks stands in the way, or a wall on a lattice plane.
#include "feeler/env/contact/mesh_outcomes.h"

#include <gtest/gtest.h>

#include "feeler/core/error.h"
#include "feeler/core/random.h"
#include "feeler/env/contact/contact_map_cache.h"

namespace feeler::env {
namespace {

TEST(MeshOutcomesTest, AgreeWithTheContactMap) {
  const TaskModel model = LoadTask("plug");
  const planner::ContactMap map = GetContactMap(model, Opening::kClosed);
  MeshOutcomes meshes(model, Opening::kClosed, map.phase());
  RandomStream random(1, 0, "mesh outcomes");
  int compared = 0;
  int different = 0;
  while (compared < 1500) {
    const Cell at(static_cast<int>(random.Index(61)) - 30, static_cast<int>(random.Index(53)) - 26,
                  static_cast<int>(random.Index(24)) - 12);
    if (map.Blocked(at)) continue;
    const GuardedMove move{kDirections[random.Index(kDirectionCount)], 1 + static_cast<int>(random.Index(16))};
    ++compared;
    different += meshes.Predict(at, move, 0) == map.Predict(at, move) ? 0 : 1;
  }
  EXPECT_LE(different, compared / 200);
  EXPECT_GT(meshes.checks(), compared);
  EXPECT_THROW(MeshOutcomes(model, Opening::kClosed, map.phase(), 0), InputError);
}

}  // namespace
}  // namespace feeler::env
