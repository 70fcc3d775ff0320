// Law: every source file that README or docs name is there.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <string>

namespace feeler {
namespace {

namespace fs = std::filesystem;

TEST(Docs, NameFilesThatExist) {
  const fs::path root = FEELER_SOURCE_DIR;
  std::vector<fs::path> pages = {root / "README.md"};
  for (const auto& entry : fs::directory_iterator(root / "docs")) {
    if (entry.path().extension() == ".md") pages.push_back(entry.path());
  }
  // Names in capitals stand for a name of the reader's.
  static const std::regex kFile(
      "(feeler/)?((tests/"
      ")?(core|planner|policies|execution|env|cad|perception|workflow|evaluation|cli|bench|models|python)/"
      "[a-z0-9_/-]+\\.(h|cpp|xml|urdf|py))");
  int named = 0;
  for (const fs::path& page : pages) {
    std::ifstream in(page);
    const std::string text((std::istreambuf_iterator<char>(in)), {});
    for (std::sregex_iterator it(text.begin(), text.end(), kFile), end; it != end; ++it) {
      // A path inside a longer one ("models/robots/ur10e.urdf" in "x/models/...") is not a name of ours.
      const auto at = static_cast<std::size_t>(it->position());
      if (at > 0 && (text[at - 1] == '/' || std::isalnum(static_cast<unsigned char>(text[at - 1])) != 0)) continue;
      ++named;
      EXPECT_TRUE(fs::exists(root / (*it)[2].str())) << page.filename() << " names " << *it->begin();
    }
  }
  EXPECT_GT(named, 20);
}

}  // namespace
}  // namespace feeler
