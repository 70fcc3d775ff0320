// Laws of `feeler report` on the command line: what cannot be reported is one line and exit 2; a fault in a folder is a
// warning by file and line, the rest is reported; the last line on stdout is the path of the page.

#include <gtest/gtest.h>

#include <filesystem>

#include "tests/cli/run_feeler.h"

namespace feeler::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kExperiment =
    R"({"name": "found", "columns": ["row", "rate"], "rows": [["ours", 0.5]], "details": {}})";

TEST(ReportCommandTest, WhatCannotBeReportedIsOneLine) {
  const std::string folder = ScratchFolder("report_bad");
  WriteFile(folder + "/file", "x");
  const auto refused = [&](const std::vector<std::string>& arguments, const std::string& word) {
    const CommandResult result = RunFeeler(arguments);
    EXPECT_EQ(result.exit_code, 2) << result.err;
    EXPECT_NE(result.err.find("feeler: error: "), std::string::npos) << result.err;
    EXPECT_NE(result.err.find(word), std::string::npos) << result.err;
    EXPECT_EQ(result.out, "");
  };
  refused({"report", folder + "/gone", "--out", folder + "/r.html"}, "no such folder");
  refused({"report", folder + "/file", "--out", folder + "/r.html"}, "is a file");
  refused({"report", folder, "--out", folder + "/r.html"}, "neither");
  WriteFile(folder + "/found.json", kExperiment);
  refused({"report", folder, "--out", folder + "/gone/r.html"}, "--out");
  refused({"report", folder, "--out", folder}, "--out");
  refused({"report", folder, "--out", folder + "/r.html", "--replay-megabytes", "-1"}, "--replay-megabytes");
  EXPECT_FALSE(fs::exists(folder + "/r.html"));
}

TEST(ReportCommandTest, FaultsAreWarningsAndThePathComesLast) {
  const std::string folder = ScratchFolder("report_good");
  WriteFile(folder + "/found.json", kExperiment);
  WriteFile(folder + "/runs.jsonl", "{\"task\": \"plug\"}\n");
  const CommandResult result = RunFeeler({"report", folder, "--out", folder + "/r.html"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.err.find("runs.jsonl line 1"), std::string::npos) << result.err;
  ASSERT_FALSE(result.out.empty());
  const std::string lines = result.out.substr(0, result.out.size() - 1);
  EXPECT_EQ(lines.substr(lines.rfind('\n') + 1), fs::absolute(folder + "/r.html").lexically_normal().string());
  const std::string page = ReadFile(folder + "/r.html");
  EXPECT_NE(page.find("runs.jsonl line 1"), std::string::npos);
  EXPECT_NE(page.find("\"found\""), std::string::npos);
  EXPECT_EQ(page.find("src=\"http"), std::string::npos);
}

}  // namespace
}  // namespace feeler::cli
