// Laws: a stream is a pure function of (seed, episode, purpose); different keys give different streams; uniforms and
// normals have their moments.
#include "feeler/core/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

namespace feeler {
namespace {

TEST(RandomStream, IsAPureFunctionOfItsKey) {
  RandomStream a(7, 3, "pose");
  RandomStream b(7, 3, "pose");
  for (int i = 0; i < 100; ++i) EXPECT_EQ(a.Next(), b.Next());
}

TEST(RandomStream, DifferentKeysGiveDifferentStreams) {
  std::set<std::uint64_t> firsts;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    for (std::uint64_t episode = 0; episode < 20; ++episode) {
      for (const char* purpose : {"pose", "noise", "transfer"})
        firsts.insert(RandomStream(seed, episode, purpose).Next());
    }
  }
  EXPECT_EQ(firsts.size(), 20U * 20U * 3U);
}

TEST(RandomStream, UniformAndNormalHaveTheirMoments) {
  RandomStream stream(1, 1, "moments");
  constexpr int kDraws = 200000;
  double uniform_sum = 0, normal_sum = 0, normal_squares = 0;
  for (int i = 0; i < kDraws; ++i) {
    const double u = stream.Uniform();
    ASSERT_GE(u, 0.0);
    ASSERT_LT(u, 1.0);
    uniform_sum += u;
    const double n = stream.Normal();
    normal_sum += n;
    normal_squares += n * n;
  }
  EXPECT_NEAR(uniform_sum / kDraws, 0.5, 5 * std::sqrt(1.0 / 12 / kDraws));
  EXPECT_NEAR(normal_sum / kDraws, 0.0, 5 / std::sqrt(kDraws));
  EXPECT_NEAR(normal_squares / kDraws, 1.0, 5 * std::sqrt(2.0 / kDraws));
}

TEST(RandomStream, IndexIsUniformOverItsRange) {
  RandomStream stream(2, 0, "index");
  int counts[7] = {};
  for (int i = 0; i < 70000; ++i) ++counts[stream.Index(7)];
  for (const int count : counts) EXPECT_NEAR(count, 10000, 5 * std::sqrt(10000));
}

}  // namespace
}  // namespace feeler
