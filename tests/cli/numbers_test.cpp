// Laws of numeric options: decimal and nothing else, all of the text, within stated bounds; else exit code 2 and one
// line that names the option. Seeds are any of 2^64.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "tests/cli/run_feeler.h"

namespace feeler::cli {
namespace {

struct NumericOption {
  std::vector<std::string> command;
  std::string option;
  std::string beyond;  ///< a number that is out of bounds
};

std::vector<NumericOption> Options() {
  const std::vector<std::string> solve = {"solve", "--problem", kProblem};
  const std::vector<std::string> run = {"run", "--task", "plug", "--policy", "open-loop"};
  const std::vector<std::string> calibrate = {"perceive", "calibrate", "--task", "plug", "--out", "/tmp/none.json"};
  const std::vector<std::string> assemble = {"assemble", "--assembly", "frame", "--check"};
  const std::vector<std::string> experiment = {"experiment", "bounds", "--out", "/tmp/none"};
  return {{solve, "--seed", "18446744073709551616"},
          {solve, "--seed", "-1"},
          {solve, "--epsilon", "1e308"},
          {solve, "--gap", "1e308"},
          {solve, "--time-limit", "0"},
          {solve, "--expansion-limit", "9223372036854775808"},
          {solve, "--jobs", "100000"},
          {run, "--episodes", "100000000000"},
          {run, "--episodes", "500000000"},
          {run, "--seed", "99999999999999999999"},
          {run, "--video-episode", "-1"},
          {run, "--confirm-limit", "-0.1"},
          {run, "--wrist-stiffness", "-1"},
          {run, "--jobs", "0"},
          {calibrate, "--frames", "2000000000"},
          {calibrate, "--poses", "2000000000"},
          {calibrate, "--installations", "0"},
          {calibrate, "--seed", "-3"},
          {assemble, "--builds", "10000000000"},
          {assemble, "--video-speed", "51"},
          {experiment, "--solver-seeds", "1000000"},
          {{"export", "--problem", kProblem}, "--upper-bound", "-1"},
          {{"export", "--problem", kProblem}, "--discount", "1.5"},
          {{"report", "/tmp", "--out", "/tmp/none.html"}, "--replay-megabytes", "1e9"},
          {{"policy", "graph", "--policy", "x", "--problem", kProblem}, "--max-depth", "-1"},
          {{"policy", "graph", "--policy", "x", "--problem", kProblem}, "--min-probability", "2"},
          {{"task", "render", "plug", "--out", "/tmp/none.png"}, "--depth", "1e999"},
          {{"task", "import", "--tool", "a.stl", "--target", "b.stl", "--out", "/tmp/none"}, "--deviation", "1.5"},
          {{"solve", "--pomdp", "none.pomdp"}, "--precision", "-1"},
          {{"solve", "--pomdp", "none.pomdp"}, "--levels", "99999999999"},
          {{"solve", "--pomdp", "none.pomdp"}, "--simulate", "99999999999"},
          {{"policy", "simulate", "--pomdp", "none.pomdp", "--policy", "none.json"}, "--max-steps", "-1"},
          {{"task", "make-pipe-parts", "--out", "/tmp"}, "--chamfer", "1e300"}};
}

TEST(Numbers, OutOfBoundsEmptyAndPartialAreRefusedByEveryOption) {
  for (const NumericOption& numeric : Options()) {
    for (const std::string& text : {numeric.beyond, std::string(), std::string("1x"), std::string("0x1"),
                                    std::string(" 1"), std::string("nan"), std::string("1,5")}) {
      std::vector<std::string> command = numeric.command;
      command.insert(command.end(), {numeric.option, text});
      const CommandResult result = RunFeeler(command);
      EXPECT_EQ(result.exit_code, 2) << numeric.option << " '" << text << "' " << result.err;
      EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
      EXPECT_NE(result.err.find(numeric.option), std::string::npos) << result.err;
    }
  }
}

TEST(Numbers, SeedsAreWholeAndDecimal) {
  const auto seed_of = [](const std::string& text) {
    const CommandResult result =
        RunFeeler({"run", "--task", "plug", "--policy", "open-loop", "--extents", "2x2x2", "--seed", text, "--json"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return nlohmann::json::parse(result.out).at("seed").get<std::uint64_t>();
  };
  EXPECT_EQ(seed_of("18446744073709551615"), 18446744073709551615U);
  EXPECT_EQ(seed_of("9223372036854775808"), 9223372036854775808U);
  EXPECT_EQ(seed_of("010"), 10U) << "octal";
}

}  // namespace
}  // namespace feeler::cli
