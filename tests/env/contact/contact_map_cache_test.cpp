// The cache of contact maps. Laws: read(store(map)) = map;  a damaged, truncated or foreign file is an InputError of
// ReadContactMap and a rebuild of GetContactMap;  a folder that cannot be written costs no more than the time to build.

#include "feeler/env/contact/contact_map_cache.h"

#include <gtest/gtest.h>
#define XXH_INLINE_ALL
#include <unistd.h>
#include <xxhash.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

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
    const ContactMap::Layer one = a.CopyOfLayer(i);
    const ContactMap::Layer other = b.CopyOfLayer(i);
    equal = one.blocked == other.blocked;
    for (int d = 0; d < kDirectionCount; ++d) equal = equal && one.travel[d] == other.travel[d];
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
/// In a new file: who has the old one mapped keeps it.
void Write(const fs::path& file, const std::string& bytes) {
  fs::remove(file);
  std::ofstream(file, std::ios::binary) << bytes;
}

/// The map as version 1 of the format has it: without gaps.
std::string FirstVersion(const ContactMap& map) {
  std::string bytes = "FEELERCM";
  const auto put = [&](const void* values, std::size_t size) { bytes.append(static_cast<const char*>(values), size); };
  const std::uint32_t head[2] = {1, static_cast<std::uint32_t>(map.orientations())};
  put(head, sizeof(head));
  for (const Cell& corner : {map.domain().min, map.domain().max}) put(corner.data(), 3 * sizeof(int));
  put(map.phase().data(), 3 * sizeof(double));
  const double margin_cells = map.margin_cells();
  put(&margin_cells, sizeof(margin_cells));
  for (int i = 0; i < map.orientations(); ++i) {
    put(map.layer(i).blocked.data(), map.layer(i).blocked.size_bytes());
    for (const auto& travel : map.layer(i).travel) put(travel.data(), travel.size_bytes());
  }
  const std::uint64_t sum = XXH3_64bits(bytes.data(), bytes.size());
  put(&sum, sizeof(sum));
  return bytes;
}

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

TEST_F(ContactMapCache, FilesOfTheFirstVersionAreReadable) {
  const ContactMap built = BuildContactMap(peg_, Opening::kClosed);
  const std::string bytes = FirstVersion(built);
  EXPECT_TRUE(Equal(planner::DecodeContactMap(bytes, "bytes"), built));
  const fs::path file = folder_ / "first";
  fs::create_directories(folder_);
  Write(file, bytes);
  EXPECT_TRUE(Equal(planner::ReadContactMap(file), built));
  // Bytes of today anywhere in memory, and mapped.
  const std::string shifted = "x" + planner::EncodeContactMap(built);
  EXPECT_TRUE(Equal(planner::DecodeContactMap(std::string_view(shifted).substr(1), "bytes"), built));
  planner::WriteContactMap(file, built);
  EXPECT_TRUE(Equal(planner::ReadContactMap(file), built));
}

TEST_F(ContactMapCache, OfSeveralAtOnceOneBuilds) {
  std::atomic<int> built{0};
  std::vector<std::jthread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&] {
      GetContactMap(peg_, Opening::kClosed, Parallelism(1), [&](auto done, auto total) {
        if (done == total) ++built;
      });
    });
  }
  threads.clear();
  EXPECT_EQ(built, 1);
  EXPECT_EQ(Files().size(), 1U);  // no lock is left behind
}

TEST_F(ContactMapCache, UnwritableFolderIsToldAndNotFatal) {
  Write(folder_, "a file where the folder should be");
  std::string reason;
  EXPECT_TRUE(Equal(GetContactMap(peg_, Opening::kClosed, {}, {}, [&](const std::string& why) { reason = why; }),
                    BuildContactMap(peg_, Opening::kClosed)));
  EXPECT_NE(reason.find(folder_.string()), std::string::npos) << reason;
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
