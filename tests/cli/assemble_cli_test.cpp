// feeler assemble. Laws: --check prints what is drawn and builds nothing;  whatever is wrong with arguments, assembly
// or databases ends with exit code 2 and one line that names it, before anything is built or written.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/cli/run_feeler.h"

namespace feeler::cli {
namespace {

namespace fs = std::filesystem;

TEST(Assemble, CheckPrintsTheDrawing) {
  const CommandResult text = RunFeeler({"assemble", "--assembly", "crane", "--check"});
  EXPECT_EQ(text.exit_code, 0) << text.err;
  EXPECT_NE(text.out.find("crane: 4 insertions, sound"), std::string::npos) << text.out;
  const CommandResult result = RunFeeler({"assemble", "--assembly", "crane", "--check", "--json"});
  const auto json = nlohmann::json::parse(result.out);
  EXPECT_EQ(json["insertions"].size(), 4U);
  EXPECT_EQ(json["insertions"][2]["part"], "jib");
  EXPECT_NEAR(json["insertions"][2]["direction"][1].get<double>(), 1.0, 1e-6);
}

TEST(Assemble, BadInputIsNamedAndNothingIsWritten) {
  const std::string folder = ScratchFolder("assemble");
  const std::string out = folder + "/build.jsonl";
  const std::string file = folder + "/own.json";
  const auto run = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "assemble");
    arguments.insert(arguments.end(), {"--out", out});
    return RunFeeler(arguments);
  };
  ExpectOneError(RunFeeler({"assemble"}), "--assembly");
  ExpectOneError(run({"--assembly", "crane"}), "--db");
  ExpectOneError(run({"--assembly", "castle", "--db", "x.db"}), "castle");
  ExpectOneError(run({"--assembly", "crane", "--db", folder + "/none.db"}), "none.db");
  ExpectOneError(run({"--assembly", "crane", "--db", "x.db", "--builds", "0"}), "--builds");
  ExpectOneError(run({"--assembly", "crane", "--db", "x.db", "--seed", "-1"}), "--seed");
  ExpectOneError(run({"--assembly", "crane", "--db", "x.db", "--video", folder + "/no/such/a.mp4"}), "--video");
  WriteFile(file, "{\"kit\": \"pipe_kit\", ");
  ExpectOneError(run({"--assembly", file, "--db", "x.db"}), "own.json");
  auto crane = nlohmann::json::parse(ReadFile(std::string(FEELER_SOURCE_DIR) + "/models/assemblies/crane.json"));
  crane["fixtures"][0]["position_m"] = {1.9, 0.0, 0.12};
  WriteFile(file, crane.dump());
  ExpectOneError(run({"--assembly", file, "--db", "x.db"}), "out of reach");
  EXPECT_FALSE(fs::exists(out));
}

}  // namespace
}  // namespace feeler::cli
