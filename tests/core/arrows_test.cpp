// Law: a room includes only headers of the rooms it may use (the arrows of the design), and its target links only
// those.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>

namespace feeler {
namespace {

namespace fs = std::filesystem;

const std::map<std::string, std::set<std::string>>& MayUse() {
  static const std::map<std::string, std::set<std::string>> kMayUse = {
      {"core", {}},
      {"planner", {"core"}},
      {"policies", {"core", "planner"}},
      {"execution", {"core", "planner", "policies"}},
      {"env", {"core", "planner"}},
      {"perception", {"core", "planner"}},
      {"workflow", {"core", "planner", "policies", "execution", "env", "perception"}},
      {"evaluation", {"core", "planner", "policies", "execution", "env", "perception", "workflow"}},
      {"cli", {"core", "planner", "policies", "execution", "env", "perception", "workflow", "evaluation"}},
  };
  return kMayUse;
}

/// The rooms that the quoted includes of a text name.
std::set<std::string> IncludedRooms(const std::string& text) {
  static const std::regex kInclude("(^|\n)\\s*#\\s*include\\s*[\"<]([a-z_]+)/");
  std::set<std::string> rooms;
  for (std::sregex_iterator it(text.begin(), text.end(), kInclude), end; it != end; ++it) {
    if (MayUse().contains((*it)[2])) rooms.insert((*it)[2]);
  }
  return rooms;
}

TEST(Arrows, ScannerSeesIncludes) {
  EXPECT_EQ(IncludedRooms("#include \"env/world.h\"\n#include <vector>\n  #include \"core/task.h\"\n"),
            (std::set<std::string>{"core", "env"}));
}

TEST(Arrows, RoomsIncludeOnlyWhatTheyMayUse) {
  const fs::path root = FEELER_SOURCE_DIR;
  int files = 0;
  for (const auto& [room, may_use] : MayUse()) {
    if (!fs::exists(root / room)) continue;
    for (const auto& entry : fs::recursive_directory_iterator(root / room)) {
      const std::string extension = entry.path().extension();
      if (extension != ".h" && extension != ".cpp") continue;
      ++files;
      std::ifstream in(entry.path());
      const std::string text((std::istreambuf_iterator<char>(in)), {});
      for (const std::string& used : IncludedRooms(text)) {
        EXPECT_TRUE(used == room || may_use.contains(used)) << entry.path() << " uses " << used;
      }
    }
  }
  EXPECT_GT(files, 20);
}

TEST(Arrows, LinkLinesFollowTheArrows) {
  std::ifstream in(fs::path(FEELER_SOURCE_DIR) / "CMakeLists.txt");
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  const std::regex line("feeler_room\\(([a-z]+)([^)]*)\\)");
  const std::regex link("feeler::([a-z]+)");
  int rooms = 0;
  for (std::sregex_iterator it(text.begin(), text.end(), line), end; it != end; ++it) {
    const std::string room = (*it)[1];
    if (!MayUse().contains(room)) continue;
    ++rooms;
    const std::string links = (*it)[2];
    for (std::sregex_iterator l(links.begin(), links.end(), link); l != end; ++l) {
      const std::string used = (*l)[1];
      if (!MayUse().contains(used)) continue;
      EXPECT_TRUE(MayUse().at(room).contains(used)) << room << " links " << used;
    }
  }
  EXPECT_EQ(rooms, static_cast<int>(MayUse().size()));
}

}  // namespace
}  // namespace feeler
