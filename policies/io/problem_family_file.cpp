#include "feeler/policies/io/problem_family_file.h"

#include <utility>
#include <vector>

#include "feeler/core/error.h"
#include "feeler/policies/io/json_input.h"

namespace feeler::policies {
namespace {

/// As many problems as an axis of 64 cells gives in three dimensions.
constexpr std::size_t kMaxEntries = std::size_t{1} << 18;

}  // namespace

planner::ProblemFamily ReadProblemFamily(const std::string& path, const Task& task) {
  const nlohmann::json document = ParseJson(ReadTextFile(path), path);
  const JsonField root(document, path);
  root.RequireKeys({"problems"});
  const JsonField list = root["problems"];
  std::vector<planner::ProblemFamily> families;
  const std::size_t count = list.ListSize(1, kMaxEntries);
  for (std::size_t i = 0; i < count; ++i) {
    const JsonField item = list[i];
    const std::string spec = item.Text();
    try {
      families.push_back(planner::ParseProblemFamily(spec, task));
    } catch (const InputError& error) {
      item.Fail(error.what(), "correct it");
    }
  }
  return planner::UnionOf(families, path);
}

}  // namespace feeler::policies
