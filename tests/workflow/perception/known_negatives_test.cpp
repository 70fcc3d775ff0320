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
  const std::vector<KnownNegative> negatives = TryKnownNegatives(finder, plug, kEye_m);
  const auto count = [&](const char* kind) {
    return std::count_if(negatives.begin(), negatives.end(), [&](const auto& n) { return n.kind == kind; });
  };
  EXPECT_EQ(count("plate"), 3);
  EXPECT_EQ(count("box"), 3);
  EXPECT_GE(count("part"), 4);
  const auto found = [&](const std::string& what) {
    const auto n = std::find_if(negatives.begin(), negatives.end(), [&](const auto& k) { return k.what == what; });
    return n == negatives.end() ? std::string("not shown") : n->found ? "found" : "told from it";
  };
  for (const char* what : {"200 x 150 x 10 mm", "100 x 100 x 100 mm", "60 x 40 x 50 mm", "pipe-into-elbow",
                           "elbow-onto-pipe", "elbow-onto-pipe-sideways"}) {
    EXPECT_EQ(found(what), "told from it") << what;
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
  const std::string line = NegativesLine({{"plate", "1 x 1 x 1 mm", false, 0.1}, {"part", "round-peg", true, 0.9}});
  EXPECT_EQ(line,
            "known negatives: 1 of 2 are taken for the target (1 plates, 0 boxes, 1 parts of other tasks): part "
            "round-peg\n");
}

}  // namespace
}  // namespace feeler::workflow
