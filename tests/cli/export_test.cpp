// Laws: an exported problem is a complete file of its format; a drawing shows the policy it was given; the commands
// name what is wrong in one line and exit with 2.
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "tests/cli/run_feeler.h"

namespace feeler::cli {
namespace {

/// Words after `key:` at the start of a line.
std::vector<std::string> WordsOf(const std::string& text, const std::string& key) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with(key + ":")) continue;
    std::istringstream rest(line.substr(key.size() + 1));
    return {std::istream_iterator<std::string>(rest), {}};
  }
  return {};
}

TEST(Export, PomdpDeclaresWhatItUses) {
  const CommandResult result = RunFeeler({"export", "--problem", kProblem, "--format", "pomdp"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(WordsOf(result.out, "values"), std::vector<std::string>{"reward"});
  const auto states = WordsOf(result.out, "states");
  const auto actions = WordsOf(result.out, "actions");
  const auto observations = WordsOf(result.out, "observations");
  ASSERT_GT(states.size(), 16U);
  ASSERT_GT(actions.size(), 16U);  // moves and a declaration per hypothesis
  ASSERT_FALSE(observations.empty());
  std::istringstream lines(result.out);
  int transitions = 0;
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("T:")) continue;
    ++transitions;
    if (transitions % 97 != 0) continue;  // a sample
    std::istringstream words(line.substr(2));
    std::string action;
    words >> action;
    EXPECT_TRUE(action == "*" || std::find(actions.begin(), actions.end(), action) != actions.end()) << line;
  }
  EXPECT_GT(transitions, 0);
}

TEST(Export, PomdpxIsBalancedXmlAndGoesToTheFile) {
  const std::string file = ScratchFolder("export") + "/slot.pomdpx";
  const CommandResult result =
      RunFeeler({"export", "--problem", kProblem, "--format", "pomdpx", "--out", file, "--upper-bound", "100"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(result.out.empty());
  const std::string xml = ReadFile(file);
  std::vector<std::string> open;
  for (std::size_t at = xml.find('<'); at != std::string::npos; at = xml.find('<', at + 1)) {
    const std::size_t end = xml.find('>', at);
    ASSERT_NE(end, std::string::npos);
    const std::string tag = xml.substr(at + 1, end - at - 1);
    if (tag.starts_with("?") || tag.starts_with("!") || tag.ends_with("/")) continue;
    if (tag.starts_with("/")) {
      ASSERT_FALSE(open.empty());
      EXPECT_EQ(open.back(), tag.substr(1));
      open.pop_back();
    } else {
      open.push_back(tag.substr(0, tag.find(' ')));
    }
  }
  EXPECT_TRUE(open.empty());
}

TEST(Export, RefusesWhatItCannotWrite) {
  ExpectOneError(RunFeeler({"export", "--problem", kProblem, "--format", "xml"}), "xml");
  ExpectOneError(RunFeeler({"export", "--problem", "/no/such.json"}), "/no/such.json");
  ExpectOneError(RunFeeler({"export"}), "--problem");
  ExpectOneError(RunFeeler({"export", "--problem", kProblem, "--upper-bound", "nan"}), "bound");
  ExpectOneError(RunFeeler({"export", "--problem", kProblem, "--out", "/no/such/folder/x.pomdp"}), "/no/such/folder");
}

TEST(PolicyGraph, DrawsAPolicyFile) {
  const std::string policy = ScratchFolder("graph") + "/policy.json";
  ASSERT_EQ(RunFeeler({"solve", "--problem", kProblem, "--out", policy}).exit_code, 0);
  const std::vector<std::string> command = {"policy", "graph", "--policy", policy, "--problem", kProblem};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), command.begin(), command.end());
    return RunFeeler(more);
  };
  const CommandResult dot = with({"--format", "dot"});
  EXPECT_EQ(dot.exit_code, 0) << dot.err;
  EXPECT_TRUE(dot.out.starts_with("digraph")) << dot.out.substr(0, 80);
  const CommandResult pruned = with({"--format", "dot", "--max-depth", "1"});
  EXPECT_LT(pruned.out.size(), dot.out.size());
  const CommandResult html = with({"--min-probability", "0.2"});
  EXPECT_EQ(html.exit_code, 0) << html.err;
  EXPECT_NE(html.out.find("<svg"), std::string::npos);

  ExpectOneError(with({"--format", "png"}), "png");
  ExpectOneError(with({"--max-depth", "-1"}), "depth");
  ExpectOneError(with({"--min-probability", "2"}), "probability");
  ExpectOneError(with({"--db", "x.db"}), "--db");
  ExpectOneError(RunFeeler({"policy", "graph", "--policy", policy}), "--problem");
  ExpectOneError(RunFeeler({"policy", "graph", "--policy", "/no/such.json", "--problem", kProblem}), "/no/such.json");
  const std::string other = std::string(FEELER_SOURCE_DIR) + "/tests/data/lshape2d.json";
  ExpectOneError(RunFeeler({"policy", "graph", "--policy", policy, "--problem", other}), "policy.json");
}

TEST(ExperimentCommand, ListsAndNamesTheKnown) {
  const CommandResult list = RunFeeler({"experiment", "--list"});
  EXPECT_EQ(list.exit_code, 0) << list.err;
  EXPECT_NE(list.out.find("table1-plug"), std::string::npos);
  ExpectOneError(RunFeeler({"experiment", "table9", "--out", "/tmp/x"}), "table3-ablation");
  ExpectOneError(RunFeeler({"experiment"}), "table3-ablation");
  ExpectOneError(RunFeeler({"experiment", "bounds"}), "--out");
  ExpectOneError(RunFeeler({"experiment", "bounds", "--out", kProblem}), kProblem);
  ExpectOneError(RunFeeler({"experiment", "bounds", "--out", kProblem + "/below"}), kProblem);
}

}  // namespace
}  // namespace feeler::cli
