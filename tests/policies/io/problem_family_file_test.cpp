// Files of problem families. Laws: a file of one spec is that spec's family; several are their union; anything else is
// one InputError that names the file and the field.

#include "feeler/policies/io/problem_family_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "feeler/core/error.h"

namespace feeler::policies {
namespace {

class ProblemFamilyFile : public testing::Test {
 protected:
  ProblemFamilyFile() {
    task_.name = "two axes";
    task_.axes = {{.kind = AxisKind::kX}, {.kind = AxisKind::kY}};
    path_ = testing::TempDir() + "/family_" + testing::UnitTest::GetInstance()->current_test_info()->name() + ".json";
  }
  ~ProblemFamilyFile() override { std::filesystem::remove(path_); }

  planner::ProblemFamily Read(const std::string& text) {
    std::ofstream(path_) << text;
    return ReadProblemFamily(path_, task_);
  }

  Task task_;
  std::string path_;
};

TEST_F(ProblemFamilyFile, IsTheUnionOfItsEntries) {
  EXPECT_EQ(Read(R"({"problems": ["2..4x3"]})").problems, planner::ParseProblemFamily("2..4x3x1").problems);
  const planner::ProblemFamily family = Read(R"({"problems": ["5x5", "2..3x2..3x1", "5x5x1"]})");
  EXPECT_EQ(family.problems.size(), 5U);
  EXPECT_EQ(family.problems.back(), (planner::Extents{5, 5, 1}));
  EXPECT_EQ(family.spec, path_);
}

TEST_F(ProblemFamilyFile, NamesWhatIsWrong) {
  for (const auto& [text, field] : {std::pair{R"({"problems": ["2x2", "2x"]})", "problems[1]"},
                                    {R"({"problems": [[2, 2]]})", "problems[0]"},
                                    {R"({"problems": []})", "problems"},
                                    {R"({"extents": ["2x2"]})", "problems"},
                                    {R"(["2x2"])", "family"},
                                    {R"({"problems": ["2x2"])", "family"}}) {
    try {
      Read(text);
      ADD_FAILURE() << "accepted: " << text;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(field), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find(path_), std::string::npos) << error.what();
    }
  }
  EXPECT_THROW(ReadProblemFamily("/nowhere/family.json", task_), InputError);
}

}  // namespace
}  // namespace feeler::policies
