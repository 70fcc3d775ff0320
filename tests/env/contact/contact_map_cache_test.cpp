// The cache of contact maps. Laws: read(store(map)) = map;  a damaged, truncated or foreign file is an InputError of
// ReadContactMap and a rebuild of GetContactMap;  a folder that cannot be written costs no more than the time to build.

#include "feeler/env/contact/contact_map_cache.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <iterator>

#include "feeler/core/error.h"
#include "feeler/planner/contact/contact_map_file.h"
#include "tests/env/task_text.h"

namespace feeler::env {
namespace {

namespace fs = std::filesystem;
using planner::ContactMap;

bool Equal(const ContactMap& a, const ContactMap& b) {
  bool equal = a.domain() == b.domain() && a.phase() == b.phase() && a.margin_cells() == b.margin_cells() &&
               a.orientations() == b.orientations();
  for (int i = 0; equal && i < a.orientations(); ++i) {
    equal = a.layer(i).blocked == b.layer(i).blocked;
    for (int d = 0; d < kDirectionCount; ++d) equal = equal && a.layer(i).travel[d] == b.layer(i).travel[d];
  }
  return equal;
}

class ContactMapCache : public ::testing::Test {
 protected:
  ContactMapCache() : peg_(LoadTaskFromText(TaskText().Mjcf(), "peg.xml")) {}
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("feeler_cache_test_" + std::to_string(::getpid()) + "_" +
                                           ::testing::UnitTest::GetInstance()->current_test_info()->name());
    ::setenv("FEELER_CACHE_DIR", folder_.c_str(), 1);
  }
  void TearDown() override {
    ::unsetenv("FEELER_CACHE_DIR");
    fs::remove_all(folder_);
  }
  std::vector<fs::path> Files() const {
    std::vector<fs::path> files;
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(folder_, error)) files.push_back(entry.path());
    return files;
  }
  fs::path folder_;
  TaskModel peg_;
};

std::string Read(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}
void Write(const fs::path& file, const std::string& bytes) { std::ofstream(file, std::ios::binary) << bytes; }

TEST_F(ContactMapCache, SecondCallReadsWhatTheFirstBuilt) {
  const ContactMap built = BuildContactMap(peg_, Opening::kClosed);
  EXPECT_TRUE(Equal(GetContactMap(peg_, Opening::kClosed), built));
  ASSERT_EQ(Files().size(), 1U);
  bool progressed = false;
  EXPECT_TRUE(
      Equal(GetContactMap(peg_, Opening::kClosed, Parallelism(), [&](auto, auto) { progressed = true; }), built));
  EXPECT_FALSE(progressed);
  GetContactMap(peg_, Opening::kOpen);
  EXPECT_EQ(Files().size(), 2U);
}

TEST_F(ContactMapCache, DamagedFilesAreFoundAndReplaced) {
  const ContactMap built = GetContactMap(peg_, Opening::kClosed);
  const fs::path file = Files().at(0);
  const std::string good = Read(file);
  std::vector<std::string> damaged = {"",         "FEELERCM",    good.substr(0, 100), good.substr(0, good.size() - 1),
                                      good + "x", "another file"};
  for (const std::size_t at : {0UL, 8UL, 12UL, 20UL, 60UL, good.size() / 2, good.size() - 1}) {
    std::string flipped = good;
    flipped[at] = static_cast<char>(flipped[at] ^ 0x10);
    damaged.push_back(flipped);
  }
  for (const std::string& bytes : damaged) {
    Write(file, bytes);
    EXPECT_THROW(planner::ReadContactMap(file), InputError);
    EXPECT_TRUE(Equal(GetContactMap(peg_, Opening::kClosed), built));
    EXPECT_EQ(Read(file), good);
  }
  EXPECT_THROW(planner::ReadContactMap(folder_ / "absent"), InputError);
}

TEST_F(ContactMapCache, UnwritableFolderIsNotFatal) {
  Write(folder_, "a file where the folder should be");
  EXPECT_TRUE(Equal(GetContactMap(peg_, Opening::kClosed), BuildContactMap(peg_, Opening::kClosed)));
  EXPECT_THROW(planner::WriteContactMap(folder_ / "map", BuildContactMap(peg_, Opening::kClosed)), InputError);
}

TEST_F(ContactMapCache, FolderFollowsTheEnvironment) {
  EXPECT_EQ(CacheFolder(), folder_);
  ::unsetenv("FEELER_CACHE_DIR");
  ::setenv("XDG_CACHE_HOME", "/somewhere", 1);
  EXPECT_EQ(CacheFolder(), fs::path("/somewhere/feeler"));
  ::unsetenv("XDG_CACHE_HOME");
}

}  // namespace
}  // namespace feeler::env
