// next_move DB [EXTENTS]: opens a database and the bundle beside it, asks the stored policy for its moves, and carries
// them out with a robot of one's own. Links no simulator.
#include <cstdio>
#include <exception>
#include <memory>
#include <string>

#include "feeler/core/error.h"
#include "feeler/core/orientation_lattice.h"
#include "feeler/execution/executor.h"
#include "feeler/policies/database_policy.h"
#include "feeler/policies/storage/task_bundle.h"
#include "spring_robot.h"

using namespace feeler;

namespace {

/// The extents asked for, else the largest problem that has a policy.
planner::Extents Choose(policies::Database& database, const char* text) {
  if (text != nullptr) return planner::ParseExtents(text, database.identity().axes);
  planner::Extents chosen;
  bool found = false;
  std::int64_t most = 0;
  for (const policies::StoredProblem& problem : database.List()) {
    const planner::Extents& e = problem.extents;
    const std::int64_t hypotheses = std::int64_t{e[0]} * e[1] * e[2] * e[3] * e[4];
    if (problem.status == "unlocalizable" || hypotheses <= most) continue;
    most = hypotheses;
    chosen = e;
    found = true;
  }
  if (!found) throw NegativeResult(database.path(), "holds no policy");
  return chosen;
}

/// Where the target would be under a hypothesis, a little off the lattice.
Pose PoseUnder(const planner::Hypothesis& h, const planner::Problem& problem, const Task& task, const Pose& estimate) {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const planner::Hypothesis& other : problem.hypotheses) centre += other.offset.cast<double>();
  centre /= static_cast<double>(problem.hypotheses.size());
  Pose offset = MakePose(task.cell_m * (h.offset.cast<double>() - centre + Eigen::Vector3d(0.2, -0.15, 0.1)));
  offset.linear() = LatticeOrientation(task, h.orientation).toRotationMatrix();
  return estimate * offset;
}

int Run(const std::string& path, const char* extents_text) {
  policies::Database database = policies::Database::OpenReadOnly(path);
  const policies::TaskBundle bundle = policies::ReadBundleOf(database);
  const planner::Extents extents = Choose(database, extents_text);
  const auto stored = database.Get(extents);
  if (!stored || !stored->policy) throw NegativeResult(path, "holds no policy for " + planner::ToString(extents));
  Task task = bundle.task;
  const planner::Problem problem = planner::MakeCuboidProblem(task, bundle.map, extents);
  std::printf("%s, %s: %zu hypotheses, expected cost %.2f\n", task.name.c_str(),
              planner::ToString(extents, task).c_str(), problem.hypotheses.size(), stored->expected_cost);

  policies::DatabasePolicy policy(std::make_shared<const planner::PolicyGraph>(*stored->policy));
  policy.Begin(problem);
  const policies::Decision next = policy.Next({problem.start, problem.hypotheses});
  if (const auto* move = std::get_if<GuardedMove>(&next)) {
    std::printf("next move: %s, %d cells of %.1f mm\n", std::string(ToString(move->direction)).c_str(), move->cells,
                1e3 * task.cell_m);
  }

  const Pose estimate = task.world_T_target;
  int inserted = 0;
  const std::size_t count = problem.hypotheses.size();
  const std::size_t episodes = std::min<std::size_t>(count, 5);
  for (std::size_t k = 0; k < episodes; ++k) {
    const planner::Hypothesis& truth = problem.hypotheses[(2 * k + 1) * count / (2 * episodes)];
    const Pose world_T_target = PoseUnder(truth, problem, task, estimate);
    SpringRobot robot(policies::TravelModelOf(bundle), world_T_target,
                      execution::LatticeStartPose(task, problem, estimate));
    execution::ExecutorOptions options;
    options.ladder = true;
    options.force_budget_n = task.force_budget_n;
    options.travel_model = policies::TravelModelOf(bundle);
    const execution::ExecutionRecord record = execution::Execute(task, problem, estimate, policy, robot, options);
    // Only one who knows the truth can say whether the tool is in.
    const Pose target_T_tool = world_T_target.inverse() * robot.ToolPose();
    const double depth_m = target_T_tool.translation().dot(UnitVector(task.insertion));
    const bool is_in = depth_m > task.insertion_depth_m - task.tolerance.vertical_m;
    std::printf("episode %zu: %zu motions, %d contacts, %s; %.1f mm deep\n", k, record.moves.size(), record.contacts,
                record.reason.c_str(), 1e3 * depth_m);
    inserted += is_in && record.believed_inserted ? 1 : 0;
  }
  std::printf("%d of %zu inserted\n", inserted, episodes);
  return inserted == static_cast<int>(episodes) ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argc > 3) {
    std::fprintf(stderr, "usage: next_move DB [EXTENTS]\n");
    return 2;
  }
  try {
    return Run(argv[1], argc == 3 ? argv[2] : nullptr);
  } catch (const NegativeResult& error) {
    std::fprintf(stderr, "next_move: %s\n", error.what());
    return 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "next_move: error: %s\n", error.what());
    return 2;
  }
}
