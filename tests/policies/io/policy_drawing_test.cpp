// Laws of the policy drawings:
// - every node of the policy is drawn once, every edge joins drawn nodes; the drawn leaves list every hypothesis;
// - cut by depth or probability, each part cut off stands as one node, and drawn probabilities of leaves and cuts sum
//   to 1 (nothing is lost silently): here, their hypotheses partition the start belief;
// - the page loads nothing and runs nothing; titles cannot inject markup.
#include "feeler/policies/io/policy_drawing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <regex>

#include "feeler/core/error.h"
#include "feeler/planner/belief/lattice_problem.h"
#include "tests/policies/brute_force.h"

namespace feeler::policies {
namespace {

planner::ExpandedPolicy SmallPolicy() {
  const planner::Problem problem = planner::MakeLatticeProblem(SmallProblemData(true));
  return planner::ExpandPolicy(problem, BruteForce(problem).MakePolicy());
}

int Count(const std::string& text, const std::string& pattern) {
  const std::regex regex(pattern);
  return static_cast<int>(std::distance(std::sregex_iterator(text.begin(), text.end(), regex), std::sregex_iterator()));
}

TEST(PolicyGraph, DrawsEveryNodeOnce) {
  const planner::ExpandedPolicy policy = SmallPolicy();
  const auto nodes = static_cast<int>(policy.nodes.size());
  const std::string dot = FormatPolicyDot(policy, "small");
  EXPECT_EQ(Count(dot, "  n[0-9]+ \\[label"), nodes);
  EXPECT_EQ(Count(dot, "  n[0-9]+ -> n[0-9]+ "), nodes - 1);
  for (int h = 0; h < 6; ++h) EXPECT_EQ(Count(dot, "label=\"h" + std::to_string(h) + "\""), 1);
  const std::string html = FormatPolicyHtml(policy, "small");
  EXPECT_EQ(Count(html, "<rect "), nodes);
  EXPECT_EQ(Count(html, "<path "), nodes - 1);
  EXPECT_EQ(Count(html, "<g class=\"leaf\">"), 6);
  EXPECT_EQ(Count(html, "<g class=\"cut\">"), 0);
}

TEST(PolicyGraph, CutsByDepthAndProbability) {
  const planner::ExpandedPolicy policy = SmallPolicy();
  int previous = 0;
  for (int depth = 0; depth < 12; ++depth) {
    const std::string dot = FormatPolicyDot(policy, "small", {depth, 0.0});
    const int drawn = Count(dot, "  n[0-9]+ \\[label");
    EXPECT_GE(drawn, previous);
    previous = drawn;
    EXPECT_TRUE(depth > 0 || drawn == 1);
    // Hypotheses behind leaves and cuts add up to all six.
    int hypotheses = 0;
    const std::regex left("fillcolor=\"#(f3f3f3|e4f4e8)\", tooltip=\"[^\"]*; ([0-9]+) hypotheses left");
    for (std::sregex_iterator it(dot.begin(), dot.end(), left), end; it != end; ++it) hypotheses += std::stoi((*it)[2]);
    EXPECT_EQ(hypotheses, 6) << "depth " << depth;
  }
  EXPECT_EQ(previous, static_cast<int>(policy.nodes.size()));
  EXPECT_GT(Count(FormatPolicyHtml(policy, "small", {100, 0.4}), "<g class=\"cut\">"), 0);
  EXPECT_THROW(FormatPolicyDot(policy, "small", {-1, 0.0}), InputError);
  EXPECT_THROW(FormatPolicyHtml(policy, "small", {1, 1.5}), InputError);
  EXPECT_THROW(FormatPolicyHtml(policy, "small", {1, std::nan("")}), InputError);
}

TEST(PolicyGraph, PageIsSelfContained) {
  const std::string html = FormatPolicyHtml(SmallPolicy(), "<script>alert(\"x\")</script> & more");
  EXPECT_EQ(html.find("<script"), std::string::npos);
  EXPECT_EQ(html.find("http"), std::string::npos);
  EXPECT_EQ(Count(html, "src=|href=|url\\("), 0);
  const std::string dot = FormatPolicyDot(SmallPolicy(), "quote \" and \\");
  EXPECT_NE(dot.find("quote \\\" and \\\\"), std::string::npos);
  if (const char* path = std::getenv("FEELER_POLICY_HTML"))
    std::ofstream(path) << FormatPolicyHtml(SmallPolicy(), "small");
}

}  // namespace
}  // namespace feeler::policies
