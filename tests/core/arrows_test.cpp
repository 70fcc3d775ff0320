// Laws: a room includes only headers of the rooms it may use (the arrows of docs/architecture.md), and its target links
// only those; inside and between rooms no sub-folders use each other, by whatever detour (the sub-folders form no
// cycle); every header of ours is spelled "feeler/ROOM/..."; no folder of the product holds more than thirty files.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

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
      {"cad", {"core", "planner", "env"}},
      {"perception", {"core", "planner"}},
      {"workflow", {"core", "planner", "policies", "execution", "env", "cad", "perception"}},
      {"evaluation", {"core", "planner", "policies", "execution", "env", "cad", "perception", "workflow"}},
      {"cli", {"core", "planner", "policies", "execution", "env", "cad", "perception", "workflow", "evaluation"}},
  };
  return kMayUse;
}

/// The headers of ours that a text includes, as they are spelled, e.g. "feeler/env/scene/world.h" or
/// "env/scene/world.h".
std::vector<std::string> IncludedHeaders(const std::string& text) {
  static const std::regex kInclude("(^|\n)[ \t]*#[ \t]*include[ \t]*[\"<]((feeler/)?([a-z_]+)/[^\">]*)");
  std::vector<std::string> headers;
  for (std::sregex_iterator it(text.begin(), text.end(), kInclude), end; it != end; ++it) {
    if ((*it)[3].matched || MayUse().contains((*it)[4])) headers.push_back((*it)[2]);
  }
  return headers;
}

struct SourceFile {
  std::string folder;  ///< from the root of the tree: "env/scene"
  std::string path;
  std::vector<std::string> headers;
};

const std::vector<SourceFile>& SourceFiles() {
  static const std::vector<SourceFile> kFiles = [] {
    const fs::path root = FEELER_SOURCE_DIR;
    std::vector<SourceFile> files;
    for (const auto& [room, unused] : MayUse()) {
      for (const auto& entry : fs::recursive_directory_iterator(root / room)) {
        const std::string extension = entry.path().extension();
        if (extension != ".h" && extension != ".cpp") continue;
        std::ifstream in(entry.path());
        const std::string text((std::istreambuf_iterator<char>(in)), {});
        const fs::path relative = fs::relative(entry.path(), root);
        files.push_back({relative.parent_path(), relative, IncludedHeaders(text)});
      }
    }
    return files;
  }();
  return kFiles;
}

std::string RoomOf(const std::string& folder) { return folder.substr(0, folder.find('/')); }
/// "feeler/env/scene/world.h" -> "env/scene"
std::string FolderOf(const std::string& header) {
  return fs::path(header.substr(std::string("feeler/").size())).parent_path();
}

/// A cycle in a graph of folders, as "a -> b -> a"; empty if there is none.
std::string FindCycle(const std::map<std::string, std::set<std::string>>& uses) {
  std::map<std::string, int> state;  // 1: on the way, 2: done
  std::vector<std::string> way;
  std::string cycle;
  const std::function<void(const std::string&)> visit = [&](const std::string& folder) {
    if (!cycle.empty() || state[folder] == 2) return;
    way.push_back(folder);
    if (state[folder] == 1) {
      for (const std::string& step : way) cycle += (cycle.empty() ? "" : " -> ") + step;
      return;
    }
    state[folder] = 1;
    if (const auto it = uses.find(folder); it != uses.end()) {
      for (const std::string& used : it->second) visit(used);
    }
    state[folder] = 2;
    way.pop_back();
  };
  for (const auto& [folder, unused] : uses) visit(folder);
  return cycle;
}

TEST(Arrows, ScannerSeesIncludes) {
  EXPECT_EQ(IncludedHeaders("#include \"feeler/env/scene/world.h\"\n#include <vector>\n  #  include <core/task.h>\n"),
            (std::vector<std::string>{"feeler/env/scene/world.h", "core/task.h"}));
}

TEST(Arrows, ScannerSeesCycles) {
  EXPECT_EQ(FindCycle({{"a", {"b"}}, {"b", {"c"}}}), "");
  EXPECT_NE(FindCycle({{"a", {"b"}}, {"b", {"c"}}, {"c", {"a"}}}), "");
}

TEST(Arrows, RoomsIncludeOnlyWhatTheyMayUse) {
  for (const SourceFile& file : SourceFiles()) {
    const std::string room = RoomOf(file.folder);
    for (const std::string& header : file.headers) {
      ASSERT_TRUE(header.starts_with("feeler/")) << file.path << " spells " << header << " without feeler/";
      const std::string used = RoomOf(FolderOf(header));
      EXPECT_TRUE(used == room || MayUse().at(room).contains(used)) << file.path << " uses " << header;
    }
  }
  EXPECT_GT(SourceFiles().size(), 400U);
}

TEST(Arrows, SubFoldersFormNoCycle) {
  std::map<std::string, std::set<std::string>> uses;
  for (const SourceFile& file : SourceFiles()) {
    for (const std::string& header : file.headers) {
      if (FolderOf(header) != file.folder) uses[file.folder].insert(FolderOf(header));
    }
  }
  EXPECT_GT(uses.size(), 30U);
  EXPECT_EQ(FindCycle(uses), "");
}

TEST(Arrows, NoFolderHoldsMoreThanThirtyFiles) {
  std::map<std::string, int> count;
  for (const SourceFile& file : SourceFiles()) ++count[file.folder];
  for (const auto& [folder, files] : count) EXPECT_LE(files, 30) << folder << " holds several subjects: name them";
}

TEST(Arrows, LinkLinesFollowTheArrows) {
  std::ifstream in(fs::path(FEELER_SOURCE_DIR) / "CMakeLists.txt");
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  const std::regex line("feeler_target\\(([a-z_]+)([^)]*)\\)");
  const std::regex rooms_of("ROOMS((?:\\s+[a-z_]+)+)");
  const std::regex word("[a-z_]+");
  // Parts of a room that have a target of their own are named ROOM_PART; `scale` are the ranks of workflow/scale.
  const auto room_of = [](const std::string& target) {
    return target == "scale" ? std::string("workflow") : target.substr(0, target.find('_'));
  };
  std::set<std::string> rooms;
  for (std::sregex_iterator it(text.begin(), text.end(), line), end; it != end; ++it) {
    const std::string room = room_of((*it)[1]);
    ASSERT_TRUE(MayUse().contains(room)) << room;
    rooms.insert(room);
    const std::string arguments = (*it)[2];
    std::smatch found;
    if (!std::regex_search(arguments, found, rooms_of)) continue;
    const std::string used_rooms = found[1];
    for (std::sregex_iterator used(used_rooms.begin(), used_rooms.end(), word); used != end; ++used) {
      const std::string other = room_of((*used)[0]);
      EXPECT_TRUE(other == room || MayUse().at(room).contains(other)) << room << " links " << other;
    }
  }
  EXPECT_EQ(rooms.size(), MayUse().size());
}

}  // namespace
}  // namespace feeler
