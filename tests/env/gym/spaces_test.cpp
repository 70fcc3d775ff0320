// Laws of the spaces: what a space contains, Step accepts (uniform samples of the box, whole numbers where asked); what
// it does not contain, Decode refuses; nothing is rounded in silence.

#include "feeler/env/gym/spaces.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "feeler/core/error.h"
#include "feeler/core/random.h"
#include "tests/env/plug_world.h"

namespace feeler::env {
namespace {

constexpr ActionKind kKinds[] = {ActionKind::kGuardedMove, ActionKind::kTransfer, ActionKind::kInsert,
                                 ActionKind::kLowLevel};

TEST(Spaces, ContainedIsAccepted) {
  InsertionEnv env(PlugScene());
  env.Reset(1);
  RandomStream random(7, 0, "spaces");
  for (const ActionKind kind : kKinds) {
    const Space space = ActionSpace(kind, env.options().bounds, env.limits().time_s);
    for (int sample = 0; sample < 1000; ++sample) {
      std::vector<double> values;
      for (const SpaceComponent& c : space.components) {
        const double value = sample == 0 ? c.low : sample == 1 ? c.high : random.Uniform(c.low, c.high);
        values.push_back(c.whole ? std::floor(value) : value);
      }
      ASSERT_TRUE(space.Contains(values)) << space.name << " " << sample;
      ASSERT_NO_THROW(env.RequireWelcome(DecodeAction(space, kind, values))) << space.name << " " << sample;
    }
  }
}

TEST(Spaces, NothingIsRoundedInSilence) {
  const Space space = ActionSpace(ActionKind::kLowLevel);
  std::vector<double> values(7, 0.0);
  values[6] = 1.5;
  EXPECT_FALSE(space.Contains(values));
  EXPECT_THROW(DecodeAction(space, ActionKind::kLowLevel, values), InputError);
  values[6] = 2.0;
  EXPECT_EQ(std::get<LowLevelAction>(DecodeAction(space, ActionKind::kLowLevel, values)).steps, 2);
}

TEST(Spaces, ADirectionOfLengthZeroIsNone) {
  const Space space = ActionSpace(ActionKind::kGuardedMove);
  std::vector<double> values = {0, 0, 0, 0.01, 0.1, 5};
  EXPECT_FALSE(space.Contains(values));
  EXPECT_THROW(DecodeAction(space, ActionKind::kGuardedMove, values), InputError);
  values[0] = -0.3;
  const Action action = DecodeAction(space, ActionKind::kGuardedMove, values);
  EXPECT_TRUE(std::get<GuardedMoveAction>(action).motion.direction.isApprox(-Eigen::Vector3d::UnitX()));
}

}  // namespace
}  // namespace feeler::env
