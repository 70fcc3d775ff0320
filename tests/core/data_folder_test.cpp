// Run-time data. Laws: what is asked for first is found first ($FEELER_MODELS, the given folder, the tree); a folder of
// models that is named and not there is refused, nothing else is tried; what is nowhere is an error that lists where it
// was looked for.

#include "feeler/core/data_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>

#include "feeler/core/error.h"

namespace feeler {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class DataFolder : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        fs::path(::testing::TempDir()) / ("data_folder_test_" + std::to_string(::getpid()));  // tests run side by side
    fs::create_directories(folder_ / "given" / "models");
    fs::create_directories(folder_ / "variable" / "models");
    fs::create_directories(folder_ / "named");
    ::unsetenv("FEELER_MODELS");
    ::unsetenv("FEELER_DATA_DIR");
  }
  void TearDown() override {
    SetDataFolder({});
    ::unsetenv("FEELER_MODELS");
    ::unsetenv("FEELER_DATA_DIR");
    fs::remove_all(folder_);
  }
  static std::string ErrorOf(const std::string& name) {
    try {
      return FindData(name).string() + " was found";
    } catch (const InputError& error) {
      return error.what();
    }
  }
  fs::path folder_;
};

TEST_F(DataFolder, TheFirstThatIsThereIsTaken) {
  EXPECT_EQ(FindData("models"), fs::path(FEELER_SOURCE_DIR) / "models");
  ::setenv("FEELER_DATA_DIR", (folder_ / "variable").c_str(), 1);
  EXPECT_EQ(FindData("models"), folder_ / "variable" / "models");
  EXPECT_EQ(FindData("evaluation/report/page"), fs::path(FEELER_SOURCE_DIR) / "evaluation/report/page");
  SetDataFolder(folder_ / "given");
  EXPECT_EQ(FindData("models"), folder_ / "given" / "models");
  ::setenv("FEELER_MODELS", (folder_ / "named").c_str(), 1);
  EXPECT_EQ(FindData("models"), folder_ / "named");
}

TEST_F(DataFolder, ANamedFolderThatIsMissingIsRefused) {
  ::setenv("FEELER_MODELS", (folder_ / "nowhere").c_str(), 1);
  EXPECT_THAT(ErrorOf("models"), HasSubstr("FEELER_MODELS names no folder"));
}

TEST_F(DataFolder, TheErrorListsWhereItWasLookedFor) {
  SetDataFolder(folder_ / "given");
  ::setenv("FEELER_DATA_DIR", (folder_ / "variable").c_str(), 1);
  const std::string error = ErrorOf("no-such-thing");
  for (const fs::path& place : {folder_ / "given", folder_ / "variable", fs::path(FEELER_SOURCE_DIR)}) {
    EXPECT_THAT(error, HasSubstr((place / "no-such-thing").string()));
  }
  EXPECT_THAT(error, HasSubstr("share/feeler/no-such-thing"));
}

}  // namespace
}  // namespace feeler
