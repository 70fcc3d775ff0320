// feeler policy: look at one policy.
#include <fmt/format.h>

#include <limits>
#include <memory>
#include <thread>

#include "feeler/cli/commands.h"
#include "feeler/cli/common/console.h"
#include "feeler/cli/common/numbers.h"
#include "feeler/cli/common/outputs.h"
#include "feeler/cli/common/progress_bar.h"
#include "feeler/cli/pomdp.h"
#include "feeler/cli/solver_flags.h"
#include "feeler/core/error.h"
#include "feeler/core/file_output.h"
#include "feeler/core/parallelism.h"
#include "feeler/planner/belief/lattice_problem.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/planner/policy/expand_policy.h"
#include "feeler/policies/io/lattice_problem_file.h"
#include "feeler/policies/io/policy_drawing.h"
#include "feeler/policies/io/policy_json.h"
#include "feeler/policies/storage/database.h"

namespace feeler::cli {
namespace {

struct PolicyFlags {
  std::string policy;
  std::string problem;
  std::string task;
  std::string extents;
  std::string db;
  std::string opening = "closed";
  std::string goal;
  std::string format = "html";
  std::string out;
  int max_depth = std::numeric_limits<int>::max();
  double min_probability = 0.0;
  int jobs = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
};

planner::Problem TaskProblem(const PolicyFlags& flags, const std::string& task, workflow::PlanningSetupOptions options,
                             const policies::Database* database) {
  ProgressBar bar("contact map");
  options.jobs = Parallelism(flags.jobs);
  options.progress = bar.Callback();
  const workflow::PlanningSetup setup = workflow::LoadPlanningSetup(task, options);
  if (database != nullptr) database->RequireFingerprint(setup.task().name, setup.fingerprint);
  const planner::Extents extents = planner::ParseExtents(flags.extents, setup.task());
  planner::RequireWithinTask({{extents}, flags.extents}, setup.task());
  return setup.ProblemOf(extents);
}

/// A policy of the database at --extents.
planner::ExpandedPolicy FromDatabase(const PolicyFlags& flags) {
  policies::Database database = policies::Database::OpenReadOnly(flags.db);
  const auto stored = database.Get(planner::ParseExtents(flags.extents, database.identity().axes));
  if (!stored) throw InputError(flags.db, "holds no problem " + flags.extents, "see feeler db list " + flags.db);
  if (!stored->policy) throw NegativeResult(flags.db, flags.extents + " holds no complete policy");
  const policies::DatabaseIdentity& identity = database.identity();
  const workflow::PlanningSetupOptions options = workflow::SetupOptionsOf(identity);
  const std::string task = flags.task.empty() ? identity.task : flags.task;
  return planner::ExpandPolicy(TaskProblem(flags, task, options, &database), *stored->policy);
}

/// A policy file, with the problem that it was made for.
planner::ExpandedPolicy FromFile(const PolicyFlags& flags) {
  const policies::PolicyFile file = policies::ReadPolicyFile(flags.policy);
  planner::Problem problem;
  if (!flags.problem.empty()) {
    planner::LatticeProblemData data = policies::ReadLatticeProblem(flags.problem);
    if (!flags.goal.empty()) data.goal = ParseGoal(flags.goal);
    problem = planner::MakeLatticeProblem(data);
  } else {
    workflow::PlanningSetupOptions options;
    options.opening = ParseOpening(flags.opening);
    if (!flags.goal.empty()) options.goal = ParseGoal(flags.goal);
    problem = TaskProblem(flags, flags.task, options, nullptr);
  }
  return planner::ExpandPolicy(problem, policies::ToPolicy(file, problem, flags.policy));
}

void RequireOneSource(const PolicyFlags& flags) {
  const std::string help = "see feeler policy graph --help";
  if (flags.policy.empty() == flags.db.empty()) throw InputError("policy graph", "give either --policy or --db", help);
  if (!flags.db.empty() && !flags.problem.empty()) throw InputError("--problem", "goes with --policy, not --db", help);
  if (!flags.policy.empty() && flags.problem.empty() == flags.task.empty()) {
    throw InputError("policy graph", "--policy needs its problem: give either --problem, or --task with --extents",
                     help);
  }
  if (flags.problem.empty() && flags.extents.empty()) {
    throw InputError("--extents", "missing", "give the extents, e.g. --extents 7x7x5");
  }
  if (!flags.problem.empty() && !flags.extents.empty()) {
    throw InputError("--extents", "goes with --task or --db, not with --problem", "leave it out");
  }
}

void Graph(const PolicyFlags& flags) {
  if (flags.format != "dot" && flags.format != "html") {
    throw InputError("--format", "unknown value \"" + flags.format + "\"", "choose one of dot, html");
  }
  RequireOneSource(flags);
  std::vector<std::string> inputs = flags.task.empty() ? std::vector<std::string>() : InputsOfTask(flags.task);
  inputs.insert(inputs.end(), {flags.policy, flags.problem, flags.db});
  RequireOutputs({{"--out", flags.out, flags.format == "dot" ? FileKind::kGraphDot : FileKind::kGraphHtml}}, inputs);
  policies::PolicyDrawingOptions options;
  options.max_depth = flags.max_depth;
  options.min_probability = flags.min_probability;
  const planner::ExpandedPolicy policy = flags.db.empty() ? FromFile(flags) : FromDatabase(flags);
  const std::string title = flags.db.empty() ? flags.policy : flags.db + " " + flags.extents;
  const std::string text = flags.format == "dot" ? policies::FormatPolicyDot(policy, title, options)
                                                 : policies::FormatPolicyHtml(policy, title, options);
  if (flags.out.empty()) {
    PrintResult(text);
  } else {
    WriteFileAtomically(flags.out, text);
  }
}

}  // namespace

void AddPolicyCommand(CLI::App& app, Session& session) {
  CLI::App* policy = app.add_subcommand("policy", "Look at one policy");
  policy->require_subcommand(1);
  AddPolicySimulateCommand(*policy, session);
  auto flags = std::make_shared<PolicyFlags>();
  CLI::App* command = policy->add_subcommand("graph", "Draw a policy of a file or a database");
  command->add_option("--policy", flags->policy, "policy file (docs/file-formats.md)");
  command->add_option("--problem", flags->problem, "lattice problem file that the policy file was made for");
  command->add_option("--task", flags->task, "task that the policy file was made for; with --db: the task's file");
  command->add_option("--extents", flags->extents, "hypotheses per axis of the task, e.g. 7x7x5 (with --task or --db)");
  command->add_option("--db", flags->db, "database to take the policy from");
  command->add_option("--opening", flags->opening, "closed or open while localizing (with --task)")
      ->capture_default_str();
  command->add_option("--goal", flags->goal, "singleton or insertable (default: the task's or file's)");
  command->add_option("--format", flags->format, "html (one page) or dot (Graphviz)")->capture_default_str();
  AddInteger(*command, "--max-depth", flags->max_depth, 0, std::numeric_limits<int>::max(),
             "draw this many moves from the root, default: all", false);
  AddReal(*command, "--min-probability", flags->min_probability, 0.0, 1.0, "leave out nodes reached more rarely");
  command->add_option("--out", flags->out, "file to write (default: standard output)");
  AddJobs(*command, flags->jobs, "threads, if the contact map must be built");
  command->callback([flags] { Graph(*flags); });
}

}  // namespace feeler::cli
