// Law: bad usage or input ends with exit code 2 and one line `feeler: error: WHERE: WHAT (HOW TO MEND)` that names what
// was wrong, and leaves nothing half-written.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/cli/run_feeler.h"

namespace feeler::cli {
namespace {

namespace fs = std::filesystem;

TEST(BadUsage, UnknownWordsAndValuesAreNamed) {
  ExpectOneError(RunFeeler({}), "subcommand");
  ExpectOneError(RunFeeler({"insert"}), "insert");
  ExpectOneError(RunFeeler({"solve", "--nonsense"}), "nonsense");
  ExpectOneError(RunFeeler({"solve"}), "--task");
  ExpectOneError(RunFeeler({"solve", "--task", "plug"}), "--extents");
  ExpectOneError(RunFeeler({"solve", "--task", "no-such-task", "--extents", "2x2x2"}), "no-such-task");
  ExpectOneError(RunFeeler({"solve", "--task", "plug", "--extents", "2x2"}), "2x2");
  ExpectOneError(RunFeeler({"solve", "--task", "plug", "--extents", "0x2x2"}), "0x2x2");
  ExpectOneError(RunFeeler({"solve", "--task", "plug", "--extents", "-3x2x2"}), "-3x2x2");
  ExpectOneError(RunFeeler({"solve", "--task", "plug", "--extents", "2x2x60"}), "2x2x60");
  ExpectOneError(RunFeeler({"solve", "--task", "plug", "--extents", "2x2x2", "--solver", "magic"}), "magic");
  ExpectOneError(RunFeeler({"solve", "--task", "plug", "--extents", "2x2x2", "--epsilon", "0.5"}), "epsilon");
  ExpectOneError(RunFeeler({"solve", "--task", "plug", "--extents", "2x2x2", "--epsilon", "nan"}), "epsilon");
  ExpectOneError(RunFeeler({"solve", "--task", "plug", "--extents", "2x2x2", "--gap", "0.9"}), "gap");
  ExpectOneError(RunFeeler({"solve", "--task", "plug", "--extents", "2x2x2", "--time-limit", "0"}), "time");
  ExpectOneError(RunFeeler({"solve", "--task", "plug", "--extents", "2x2x2", "--expansion-limit", "-1"}), "expansion");
  ExpectOneError(RunFeeler({"solve", "--problem", "/no/such/file.json"}), "/no/such/file.json");
  ExpectOneError(RunFeeler({"solve", "--task", "plug", "--extents", "2x2x2", "--seed", "-1"}), "--seed");
  ExpectOneError(RunFeeler({"run", "--task", "plug", "--wrist-stiffness", "1000"}), "give 2000 or more");
}

TEST(BadProblemFile, EveryFaultIsNamedWithItsPlaceAndItsMend) {
  const std::string file = ScratchFolder("problem") + "/problem.json";
  const nlohmann::json sound = {
      {"name", "sound"},           {"size", {6, 6, 1}},
      {"start", {0, 0, 0}},        {"tool", {{0, 0, 0}}},
      {"target", {{4, 4, 0}}},     {"hypotheses", {{0, 0, 0, 1}, {1, 0, 0, 2.5}}},
      {"move_lengths", {1, 2, 4}}, {"cost", {{"per_cell", 1}, {"per_contact", 0}, {"per_action", 0}}}};
  const auto expect = [&](const std::string& text, const std::string& named) {
    std::ofstream(file) << text;
    ExpectOneError(RunFeeler({"solve", "--problem", file, "--json"}), named);
  };
  std::ofstream(file) << sound.dump();
  EXPECT_EQ(RunFeeler({"solve", "--problem", file, "--json"}).exit_code, 0);
  const auto expect_with = [&](const char* pointer, const nlohmann::json& value, const std::string& named) {
    nlohmann::json bad = sound;
    bad[nlohmann::json::json_pointer(pointer)] = value;
    expect(bad.dump(), named);
  };
  expect_with("/size/0", -3, "size[0]");
  expect_with("/size/1", 2.5, "size[1]");
  expect_with("/size", {1000, 1000, 1000}, "size");
  expect_with("/size", {6, 6}, "size");
  expect_with("/start", {4, 4, 0}, "hypotheses[0]");
  expect_with("/start", {6, 0, 0}, "start[0]");
  expect_with("/hypotheses", nlohmann::json::array(), "hypotheses");
  expect_with("/hypotheses/1", {0, 0, 0, 1}, "hypotheses[1]");
  expect_with("/hypotheses/1", {1, 0, 0}, "hypotheses[1]");
  expect_with("/hypotheses/0/3", 0, "hypotheses[0][3]");
  expect_with("/hypotheses/0/3", -1, "hypotheses[0][3]");
  expect_with("/hypotheses/0/3", nullptr, "hypotheses[0][3]");
  expect_with("/hypotheses/0/3", "nan", "hypotheses[0][3]");
  expect_with("/move_lengths", {2, 1}, "move_lengths[1]");
  expect_with("/move_lengths", {0}, "move_lengths[0]");
  expect_with("/cost/per_cell", -1, "cost.per_cell");
  expect_with("/cost/per_cell", 0, "cost");
  expect_with("/colour", "red", "colour");
  expect_with("/goal", "nirvana", "goal");
  nlohmann::json incomplete = sound;
  incomplete.erase("target");
  expect(incomplete.dump(), "target");
  expect(sound.dump().substr(0, 60), "JSON");
  expect("", "JSON");
}

TEST(BadUsage, PreprocessRefusesBadFamiliesAndPlaces) {
  const std::string folder = ScratchFolder("preprocess");
  const std::string db = folder + "/x.db";
  for (const std::string family : {"2..99x2..3x2..3", "5..2x2x2", "2x2", "axbxc", "0..3x2x2", "-1x2x2", "1e9x1x1"}) {
    ExpectOneError(RunFeeler({"preprocess", "--task", "plug", "--out", db, "--family", family}), "");
    EXPECT_FALSE(fs::exists(db)) << family;
  }
  ExpectOneError(RunFeeler({"preprocess", "--task", "plug", "--out", "/no/such/folder/x.db"}), "/no/such/folder");
  ExpectOneError(RunFeeler({"preprocess", "--task", "plug", "--out", folder}), "directory");
  ExpectOneError(RunFeeler({"preprocess", "--task", "plug", "--out", db, "--jobs", "0"}), "--jobs");
  ExpectOneError(RunFeeler({"preprocess", "--task", "plug", "--out", db, "--order", "fast"}), "fast");
  EXPECT_FALSE(fs::exists(db));
}

TEST(BadUsage, RunRefusesWhatItCannotRun) {
  ExpectOneError(RunFeeler({"run", "--task", "plug"}), "--db");
  ExpectOneError(RunFeeler({"run", "--task", "plug", "--policy", "psychic"}), "psychic");
  ExpectOneError(RunFeeler({"run", "--task", "plug", "--policy", "psychic"}), "tbl-submodular");
  ExpectOneError(RunFeeler({"run", "--task", "plug", "--policy", "tbl", "--policy-option", "patience=3"}),
                 "tbl-actions");
  ExpectOneError(RunFeeler({"run", "--task", "plug", "--policy", "tbl", "--policy-option", "tbl-actions=many"}),
                 "tbl-actions=many");
  ExpectOneError(RunFeeler({"run", "--task", "plug", "--policy", "open-loop", "--episodes", "0"}), "--episodes");
  ExpectOneError(RunFeeler({"run", "--task", "plug", "--policy", "open-loop", "--episodes", "-5"}), "--episodes");
  ExpectOneError(RunFeeler({"run", "--task", "plug", "--policy", "open-loop", "--noise", "loud"}), "loud");
  ExpectOneError(RunFeeler({"run", "--task", "plug", "--db", "/no/such.db"}), "/no/such.db");
  ExpectOneError(RunFeeler({"run", "--task", "plug", "--policy", "open-loop", "--out", "/no/such/folder/e.jsonl"}),
                 "/no/such/folder");
}

/// A database of two small problems, made once.
const std::string& SmallDatabase() {
  static const std::string path = [] {
    const std::string file = ScratchFolder("db") + "/small.db";
    const CommandResult result =
        RunFeeler({"preprocess", "--task", "plug", "--out", file, "--family", "2..3x2x2", "--jobs", "2"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return file;
  }();
  return path;
}

TEST(BadDatabase, IsRefusedWhateverIsWrongWithIt) {
  const std::string good = ReadFile(SmallDatabase());
  ASSERT_GT(good.size(), 4096U);
  const std::string folder = ScratchFolder("broken");
  const auto expect_refused = [&](const std::string& name, const std::string& content) {
    const std::string file = folder + "/" + name;
    WriteFile(file, content);
    ExpectOneError(RunFeeler({"db", "verify", file}), file);
    ExpectOneError(RunFeeler({"preprocess", "--task", "plug", "--out", file, "--family", "2..3x2x2"}), file);
    EXPECT_EQ(ReadFile(file), content) << name << " was changed";
  };
  expect_refused("truncated.db", good.substr(0, good.size() / 2));
  expect_refused("text.db", "this is not a database\n");
  for (const double share : {0.1, 0.35, 0.6, 0.85}) {
    std::string flipped = good;
    // A byte of the page's content: the share of the file, moved off the free space that a page may hold.
    std::size_t position = static_cast<std::size_t>(share * static_cast<double>(good.size()));
    while (position < good.size() && good[position] == 0) ++position;
    flipped[position] = static_cast<char>(flipped[position] ^ 0x10);
    WriteFile(folder + "/flipped.db", flipped);
    const CommandResult result = RunFeeler({"db", "verify", folder + "/flipped.db"});
    EXPECT_EQ(result.exit_code, 2) << share << " " << result.out << result.err;
  }
}

TEST(BadDatabase, OfAnotherSettingOrTaskIsRefusedAndKept) {
  const std::string before = ReadFile(SmallDatabase());
  ExpectOneError(RunFeeler({"preprocess", "--task", "plug", "--out", SmallDatabase(), "--gap", "1.5"}), "small.db");
  const std::string task = ReadFile(std::string(FEELER_SOURCE_DIR) + "/models/tasks/plug.xml");
  EXPECT_EQ(ReadFile(SmallDatabase()), before);
}

}  // namespace
}  // namespace feeler::cli
