#include "feeler/evaluation/acceptance/acceptance_guarded_moves.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/core/random.h"
#include "feeler/core/worker_pool.h"
#include "feeler/env/contact/line_sweep.h"
#include "feeler/env/robot/simulated_robot.h"
#include "feeler/env/robot/tool_kinematics.h"
#include "feeler/evaluation/harness/cell_store.h"
#include "feeler/evaluation/records/statistics.h"
#include "feeler/version.h"
#include "feeler/workflow/episode/episode.h"
#include "feeler/workflow/setup/planning_setup.h"

namespace feeler::evaluation {
namespace {

using nlohmann::json;

constexpr std::array<const char*, 2> kNoises = {"ideal", "friction"};
constexpr double kClearance_m = 0.0006;  ///< of a start from every wall
constexpr double kTie_m = 1e-4;          ///< a move that ends so close to a wall may be read either way
constexpr std::int64_t kBlock = 50;      ///< moves in a cell of the store

/// A move from a displacement of the tool from the target, and how far geometry lets it go.
struct Trial {
  Eigen::Vector3d start_m;
  Direction direction;
  double distance_m;
  double free_m;  ///< to the wall, or more than distance_m
};

/// Draws trials around a target, judged by geometry. One per thread.
class TrialMaker {
 public:
  TrialMaker(const workflow::PlanningSetup& setup, const env::ObstacleSet& obstacles)
      : setup_(setup), sweep_(obstacles, 1e-6), judge_(setup.model, setup.model.target_geoms) {}

  /// Empty if the drawn start is not free.
  std::optional<Trial> Draw(RandomStream& random) {
    const CellBox& domain = setup_.map->domain();
    const double cell_m = setup_.task().axes.front().resolution;
    Trial trial;
    for (int axis = 0; axis < 3; ++axis) {
      trial.start_m[axis] = cell_m * random.Uniform(domain.min[axis], domain.max[axis]);
    }
    trial.direction = kDirections[random.Index(kDirectionCount)];
    trial.distance_m = cell_m * static_cast<double>(1 << random.Index(5));
    if (!IsClear(trial.start_m)) return std::nullopt;
    trial.free_m = Free(trial.start_m, trial.direction);
    // Moves that end far from every wall teach nothing: one in sixty-four is kept.
    if (trial.free_m > trial.distance_m + cell_m && random.Index(64) != 0) return std::nullopt;
    return trial;
  }

 private:
  bool IsClear(const Eigen::Vector3d& start_m) {
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3d offset((corner & 1) != 0 ? 1 : -1, (corner & 2) != 0 ? 1 : -1, (corner & 4) != 0 ? 1 : -1);
      if (judge_.Overlap(start_m + kClearance_m * offset)) return false;
    }
    return !judge_.Overlap(start_m);
  }

  double Free(const Eigen::Vector3d& start_m, Direction direction) {
    const int axis = AxisOf(direction);
    double free_m = 1.0;
    for (const env::BlockedStretch& stretch : sweep_.Sweep(axis, start_m, true)) {
      const double way_m = SignOf(direction) > 0 ? stretch.low_m - start_m[axis] : start_m[axis] - stretch.high_m;
      if (way_m >= 0.0) free_m = std::min(free_m, way_m);
    }
    return free_m;
  }

  const workflow::PlanningSetup& setup_;
  env::LineSweep sweep_;
  env::OverlapJudge judge_;
};

/// [free, distance, travelled, contact] in metres, or null if the arm cannot start there.
json Measure(const Trial& trial, env::SimulatedRobot& robot, const env::NoiseOptions& noise, RandomStream random) {
  const env::Scene& scene = robot.world().scene();
  const Pose target = scene.task.world_T_target;
  Pose start = target;
  start.translation() += start.linear() * trial.start_m;
  const std::vector<env::JointVector> branches = env::ToolInverseKinematics(scene, start);
  if (branches.empty()) return nullptr;
  const auto distance_from_home = [&](const env::JointVector& q) { return (q - scene.home_q_rad).norm(); };
  const env::JointVector q =
      *std::min_element(branches.begin(), branches.end(), [&](const env::JointVector& a, const env::JointVector& b) {
        return distance_from_home(a) < distance_from_home(b);
      });
  if (distance_from_home(q) > 2.0) return nullptr;
  try {
    robot.Reset(q, target, noise, random);
  } catch (const InputError&) {
    return nullptr;  // something else is in the way
  }
  GuardedMotion motion;
  motion.direction = target.linear() * UnitVector(trial.direction);
  motion.distance_m = trial.distance_m;
  motion.contact_force_n = noise.contact_threshold_n;
  const MotionResult result = robot.Guarded(motion);
  if (result.reason != StopReason::kReached && result.reason != StopReason::kContact) return nullptr;
  return {trial.free_m, trial.distance_m, result.travelled_m, result.contact};
}

struct Figures {
  int moves = 0;
  int contacts = 0;
  int ties = 0;
  Rate agree;        ///< of all moves
  Rate agree_clear;  ///< of moves that end farther than kTie_m from a tie
  std::vector<double> stop_errors_m;
};

Figures FiguresOf(const std::vector<json>& moves) {
  Figures figures;
  int agree = 0, agree_clear = 0;
  for (const json& move : moves) {
    const double free_m = move[0].get<double>();
    const double distance_m = move[1].get<double>();
    const double travelled_m = move[2].get<double>();
    const bool contact = move[3].get<bool>();
    const bool expected = free_m < distance_m;
    const bool tie = std::abs(free_m - distance_m) < kTie_m;
    ++figures.moves;
    figures.contacts += contact ? 1 : 0;
    figures.ties += tie ? 1 : 0;
    agree += contact == expected ? 1 : 0;
    agree_clear += !tie && contact == expected ? 1 : 0;
    if (contact && expected) figures.stop_errors_m.push_back(std::abs(travelled_m - free_m));
  }
  figures.agree = WilsonRate(agree, figures.moves);
  figures.agree_clear = WilsonRate(agree_clear, figures.moves - figures.ties);
  return figures;
}

/// The moves of a block under a noise: the same under each. Fewer where it was cancelled.
json MeasureBlock(TrialMaker& maker, env::SimulatedRobot& robot, const char* noise_name,
                  const ExperimentRequest& request, std::int64_t block) {
  const env::NoiseOptions noise = env::NoisePreset(noise_name);
  json moves = json::array();
  RandomStream random(request.seed, static_cast<std::uint64_t>(block), "guarded moves");
  while (static_cast<std::int64_t>(moves.size()) < kBlock) {
    if (request.cancellation != nullptr && request.cancellation->cancelled()) break;
    const std::optional<Trial> trial = maker.Draw(random);
    if (!trial) continue;
    json move = Measure(*trial, robot, noise,
                        RandomStream(request.seed, static_cast<std::uint64_t>(block * kBlock) + moves.size(),
                                     "sensor of guarded moves"));
    if (!move.is_null()) moves.push_back(std::move(move));
  }
  return moves;
}

}  // namespace

ExperimentResult RunAcceptanceGuardedMoves(const ExperimentRequest& request) {
  const std::int64_t blocks = request.quick ? 2 : 40;
  workflow::PlanningSetupOptions setup_options;
  setup_options.jobs = request.jobs;
  setup_options.progress = request.map_progress;
  const workflow::PlanningSetup setup = workflow::LoadPlanningSetup("plug", setup_options);
  const std::shared_ptr<const env::Scene> scene = workflow::BuildEpisodeScene(setup);
  const env::ObstacleSet obstacles(setup.model, {setup.model.tool_geoms, setup.model.target_geoms},
                                   Eigen::Quaterniond::Identity());

  ExperimentResult result;
  result.seeds = {request.seed};
  result.settings = {
      {"experiment", kAcceptanceGuardedMovesName}, {"version", FEELER_VERSION}, {"task", setup.task().name},
      {"fingerprint", setup.fingerprint},          {"seed", request.seed},      {"moves", blocks * kBlock}};
  CellStore cells(PartialFile(request, kAcceptanceGuardedMovesName), result.settings);
  const auto cell_of = [](std::size_t noise, std::int64_t block) {
    return fmt::format("{} {}", kNoises[noise], block);
  };

  const auto total = static_cast<std::int64_t>(kNoises.size()) * blocks;
  const auto cancelled = [&] { return request.cancellation != nullptr && request.cancellation->cancelled(); };
  std::mutex mutex;  // guards done
  std::int64_t done = 0;
  const auto make_worker = [&] {
    return [&, maker = TrialMaker(setup, obstacles),
            robot = std::make_unique<env::SimulatedRobot>(scene)](std::size_t i) mutable {
      const std::size_t noise = i / static_cast<std::size_t>(blocks);
      const std::int64_t block = static_cast<std::int64_t>(i) % blocks;
      const std::string cell = cell_of(noise, block);
      if (cells.Find(cell) == nullptr) {
        json moves = MeasureBlock(maker, *robot, kNoises[noise], request, block);
        if (cancelled()) return;
        cells.Put(cell, std::move(moves));
      }
      const std::lock_guard lock(mutex);
      ++done;
      if (request.progress) request.progress(done, total);
    };
  };
  RunWorkers(static_cast<std::size_t>(total), request.jobs, make_worker, request.cancellation);
  if (cancelled()) return result;

  result.complete = true;
  result.table.columns = {"noise",
                          "moves",
                          "contacts",
                          "agree",
                          "agree_low",
                          "agree_high",
                          "ties",
                          "agree_clear",
                          "stop_error_p50_mm",
                          "stop_error_p95_mm",
                          "stop_error_max_mm"};
  result.text = fmt::format(
      "Guarded moves at 50 mm/s around the {}, in physics against geometry. A tie ends within {:g} mm of a wall.\n\n"
      "{:<10} {:>6} {:>9} {:>26} {:>6} {:>15} {:>24}\n",
      setup.task().name, 1e3 * kTie_m, "noise", "moves", "contacts", "outcome right %", "ties", "right without",
      "stop error p50/p95/max mm");
  for (std::size_t noise = 0; noise < kNoises.size(); ++noise) {
    std::vector<json> moves;
    for (std::int64_t block = 0; block < blocks; ++block) {
      for (const json& move : *cells.Find(cell_of(noise, block))) moves.push_back(move);
    }
    const Figures f = FiguresOf(moves);
    const std::array<double, 3> errors = {1e3 * Quantile(f.stop_errors_m, 0.5), 1e3 * Quantile(f.stop_errors_m, 0.95),
                                          1e3 * Quantile(f.stop_errors_m, 1.0)};
    result.table.rows.push_back({kNoises[noise], f.moves, f.contacts, f.agree.value, f.agree.low, f.agree.high, f.ties,
                                 f.agree_clear.value, errors[0], errors[1], errors[2]});
    result.text += fmt::format(
        "{:<10} {:>6} {:>9} {:>26} {:>6} {:>15.2f} {:>24}\n", kNoises[noise], f.moves, f.contacts,
        fmt::format("{:.2f} ({:.2f} .. {:.2f})", 100 * f.agree.value, 100 * f.agree.low, 100 * f.agree.high), f.ties,
        100 * f.agree_clear.value, fmt::format("{:.3f}/{:.3f}/{:.3f}", errors[0], errors[1], errors[2]));
  }
  return result;
}

}  // namespace feeler::evaluation
