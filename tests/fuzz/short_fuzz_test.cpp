// The short form of the campaign (docs/fuzzing.md). Law: whatever the bytes, a reader gives a value or a feeler::Error
// of one printable line that says how to mend; and it accepts its seeds, so that mutations begin inside the format:
// one at least is short enough to be kept whole.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/fuzz/mutate.h"
#include "tests/fuzz/readers.h"

namespace feeler::fuzz {
namespace {

class ShortFuzz : public testing::TestWithParam<int> {};

TEST_P(ShortFuzz, ReadersRefuseOrRead) {
  const Reader& reader = Readers()[static_cast<std::size_t>(GetParam())];
  const std::vector<std::string> seeds = Seeds(reader);
  ASSERT_FALSE(seeds.empty());
  int read = 0;
  for (const std::string& seed : seeds) read += ReadOnce(reader, seed) ? 1 : 0;
  EXPECT_GT(read, 0) << reader.name << " accepts none of its seeds";
  constexpr std::uint64_t kInputs = 2000;
  constexpr std::size_t kMostBytes = 1 << 14;
  std::size_t least = kMostBytes;
  for (const std::string& seed : seeds) least = std::min(least, seed.size());
  EXPECT_LT(least, kMostBytes) << reader.name << " has no seed that is not cut off";
  for (std::uint64_t k = 0; k < kInputs; ++k) {
    RandomStream random(20261128, k, reader.name);
    const std::string bytes = Mutate(seeds, random, kMostBytes);
    EXPECT_NO_THROW(ReadOnce(reader, bytes)) << reader.name << ", input " << k;
  }
}

INSTANTIATE_TEST_SUITE_P(Readers, ShortFuzz, testing::Range(0, static_cast<int>(Readers().size())),
                         [](const auto& param) { return Readers()[static_cast<std::size_t>(param.param)].name; });

}  // namespace
}  // namespace feeler::fuzz
