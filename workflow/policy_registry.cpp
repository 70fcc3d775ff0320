#include "workflow/policy_registry.h"

#include <array>

#include "core/error.h"
#include "policies/database_policy.h"
#include "policies/open_loop.h"

namespace feeler::workflow {
namespace {

struct Entry {
  const char* name;
  bool needs_database;
  bool uses_ladder;
  std::unique_ptr<policies::Policy> (*make)(policies::Database* database, const planner::Problem& problem,
                                            const planner::Extents& extents);
};

std::unique_ptr<policies::Policy> MakeDatabase(policies::Database* database, const planner::Problem& /*problem*/,
                                               const planner::Extents& extents) {
  const auto stored = database->Get(extents);
  if (!stored || !stored->policy) {
    throw InputError(database->path(), "holds no policy for problem " + planner::ToString(extents),
                     "add it with feeler preprocess --family " + planner::ToString(extents));
  }
  return std::make_unique<policies::DatabasePolicy>(std::make_shared<const planner::Policy>(*stored->policy));
}

std::unique_ptr<policies::Policy> MakeOpenLoop(policies::Database* /*database*/, const planner::Problem& /*problem*/,
                                               const planner::Extents& /*extents*/) {
  return std::make_unique<policies::OpenLoopPolicy>();
}

constexpr std::array<Entry, 2> kPolicies = {{
    {"database", true, true, MakeDatabase},
    {"open-loop", false, false, MakeOpenLoop},
}};

const Entry& Find(const std::string& name) {
  for (const Entry& entry : kPolicies) {
    if (name == entry.name) return entry;
  }
  std::string known;
  for (const std::string& other : PolicyNames()) known += (known.empty() ? "" : ", ") + other;
  throw InputError("--policy", "unknown policy \"" + name + "\"", "choose one of " + known);
}

}  // namespace

std::vector<std::string> PolicyNames() {
  std::vector<std::string> names;
  for (const Entry& entry : kPolicies) names.emplace_back(entry.name);
  return names;
}

bool UsesLadder(const std::string& name) { return Find(name).uses_ladder; }

PolicyFactory MakePolicyFactory(const std::string& name, std::shared_ptr<policies::Database> database) {
  const Entry& entry = Find(name);
  if (entry.needs_database && !database) {
    throw InputError("--policy " + name, "needs a database", "give one with --db FILE.db");
  }
  return [make = entry.make, database](const planner::Problem& problem, const planner::Extents& extents) {
    return make(database.get(), problem, extents);
  };
}

}  // namespace feeler::workflow
