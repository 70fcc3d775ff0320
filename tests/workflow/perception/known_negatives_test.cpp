// Laws: plates, boxes and parts of other tasks are shown; those of other size or shape are told from the plug's inlet;
// parts that a camera cannot tell from it (the same inlet in another colour) are not among them.
#include "feeler/workflow/perception/known_negatives.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "feeler/core/progress.h"
#include "feeler/workflow/perception/calibrate.h"

namespace feeler::workflow {
namespace {

const Eigen::Vector3d kEye_m(-0.3, 0.5, 1.0);

TEST(KnownNegatives, AreShownAndToldFromTheTargetWhereTheyDiffer) {
  const env::TaskModel plug = env::LoadTask("plug");
  const TargetFinder finder(plug);
  const std::vector<KnownNegative> negatives = TryKnownNegatives(finder, plug, kEye_m, nullptr, true);
  const auto count = [&](const char* kind) {
    return std::count_if(negatives.begin(), negatives.end(), [&](const auto& n) { return n.kind == kind; });
  };
  EXPECT_EQ(count("plate"), 6);
  EXPECT_EQ(count("box"), 4);
  EXPECT_GE(count("part"), 4);
  const auto found = [&](const std::string& what) {
    const auto n = std::find_if(negatives.begin(), negatives.end(), [&](const auto& k) { return k.what == what; });
    return n == negatives.end() ? std::string("not shown") : n->found ? "found" : "told from it";
  };
  for (const KnownNegative& negative : negatives) {
    if (negative.what == "round-peg")
      continue;  // another hole in the same panel, its housing less than 12 mm different
    EXPECT_FALSE(negative.found) << negative.what << ": fitness " << negative.evidence.fitness;
  }
  EXPECT_EQ(found("plug"), "not shown");
  EXPECT_EQ(found("plug-black"), "not shown") << "the same inlet, painted";
  EXPECT_EQ(found("plug-tight"), "not shown") << "the same to a camera";
}

TEST(KnownNegatives, EndWhenAsked) {
  const env::TaskModel plug = env::LoadTask("plug");
  CancellationToken stop;
  stop.Cancel();
  EXPECT_TRUE(TryKnownNegatives(TargetFinder(plug), plug, kEye_m, &stop).empty());
}

TEST(KnownNegatives, TheLineNamesWhatIsTaken) {
  const std::string line = NegativesLine({{"plate", "1 x 1 x 1 mm", false, {}}, {"part", "round-peg", true, {}}});
  EXPECT_EQ(line,
            "known negatives: 1 of 2 are taken for the target (1 plates, 0 boxes, 1 parts of other tasks): part "
            "round-peg\n");
}

}  // namespace
}  // namespace feeler::workflow
