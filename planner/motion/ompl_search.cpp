#include "feeler/planner/motion/ompl_search.h"

#include <ompl/base/MotionValidator.h>
#include <ompl/base/ProblemDefinition.h>
#include <ompl/base/SpaceInformation.h>
#include <ompl/base/StateValidityChecker.h>
#include <ompl/base/goals/GoalStates.h>
#include <ompl/base/spaces/RealVectorStateSpace.h>
#include <ompl/base/terminationconditions/IterationTerminationCondition.h>
#include <ompl/datastructures/NearestNeighborsLinear.h>
#include <ompl/geometric/PathGeometric.h>
#include <ompl/geometric/PathSimplifier.h>
#include <ompl/geometric/planners/rrt/RRTConnect.h>
#include <ompl/util/Console.h>

#include <memory>

#include "feeler/core/random.h"

namespace feeler::planner {
namespace {

namespace ob = ompl::base;
namespace og = ompl::geometric;

std::uint_fast32_t LocalSeed(std::uint64_t seed, std::string_view purpose) {
  return static_cast<std::uint_fast32_t>(RandomStream(seed, 0, purpose).Next() & 0xffffffffU);
}

// OMPL's generators take their seeds from a process-wide sequence, so each one that is used is given its own.
class SeededSampler : public ob::RealVectorStateSampler {
 public:
  SeededSampler(const ob::StateSpace* space, std::uint_fast32_t seed) : ob::RealVectorStateSampler(space) {
    rng_.setLocalSeed(seed);
  }
};

class SeededRrtConnect : public og::RRTConnect {
 public:
  SeededRrtConnect(const ob::SpaceInformationPtr& information, std::uint_fast32_t seed) : og::RRTConnect(information) {
    rng_.setLocalSeed(seed);
  }
};

class SeededSimplifier : public og::PathSimplifier {
 public:
  SeededSimplifier(const ob::SpaceInformationPtr& information, std::uint_fast32_t seed)
      : og::PathSimplifier(information) {
    rng_.setLocalSeed(seed);
  }
};

// Joint space with the sweep as its metric.
class SweepSpace : public ob::RealVectorStateSpace {
 public:
  SweepSpace(const Eigen::VectorXd& reach_m, unsigned dimension)
      : ob::RealVectorStateSpace(dimension), reach_m_(reach_m) {}

  double distance(const ob::State* a, const ob::State* b) const override {
    return reach_m_.dot((Values(a) - Values(b)).cwiseAbs());
  }
  double getMaximumExtent() const override {
    double extent = 0.0;
    for (unsigned i = 0; i < dimension_; ++i) extent += reach_m_[i] * (bounds_.high[i] - bounds_.low[i]);
    return extent;
  }
  Eigen::Map<const Eigen::VectorXd> Values(const ob::State* state) const {
    return {state->as<StateType>()->values, static_cast<Eigen::Index>(dimension_)};
  }

 private:
  Eigen::VectorXd reach_m_;
};

class Validity : public ob::StateValidityChecker {
 public:
  Validity(const ob::SpaceInformationPtr& information, const SweepSpace& space, const ValidityFunction& valid)
      : ob::StateValidityChecker(information), space_(space), valid_(valid) {}
  bool isValid(const ob::State* state) const override { return valid_(space_.Values(state)); }

 private:
  const SweepSpace& space_;
  const ValidityFunction& valid_;
};

class Motions : public ob::MotionValidator {
 public:
  Motions(const ob::SpaceInformationPtr& information, const SweepSpace& space, const TransferPlanner& planner)
      : ob::MotionValidator(information), space_(space), planner_(planner) {}
  bool checkMotion(const ob::State* a, const ob::State* b) const override {
    return planner_.MotionValid(space_.Values(a), space_.Values(b));
  }
  bool checkMotion(const ob::State* a, const ob::State* b, std::pair<ob::State*, double>& last_valid) const override {
    if (checkMotion(a, b)) return true;
    last_valid.second = 0.0;  // nothing here asks how far an invalid motion gets
    if (last_valid.first != nullptr) si_->copyState(last_valid.first, a);
    return false;
  }

 private:
  const SweepSpace& space_;
  const TransferPlanner& planner_;
};

// OMPL narrates on the console; its results say all that we need.
void SilenceOmpl() {
  static const bool silenced = [] {
    ompl::msg::noOutputHandler();
    return true;
  }();
  (void)silenced;
}

}  // namespace

std::vector<Eigen::VectorXd> SearchWay(const TransferPlanner& planner, const ValidityFunction& valid,
                                       const Eigen::VectorXd& start, const std::vector<Eigen::VectorXd>& goals,
                                       int iterations, std::uint64_t seed) {
  SilenceOmpl();
  const auto dimension = static_cast<unsigned>(start.size());
  const auto space = std::make_shared<SweepSpace>(planner.options().reach_m, dimension);
  ob::RealVectorBounds bounds(dimension);
  for (unsigned i = 0; i < dimension; ++i) {
    bounds.setLow(i, planner.bounds().lower_rad[i]);
    bounds.setHigh(i, planner.bounds().upper_rad[i]);
  }
  space->setBounds(bounds);
  space->setStateSamplerAllocator([sampler_seed = LocalSeed(seed, "transfer sampler")](const ob::StateSpace* sampled) {
    return std::make_shared<SeededSampler>(sampled, sampler_seed);
  });
  const auto information = std::make_shared<ob::SpaceInformation>(space);
  information->setStateValidityChecker(std::make_shared<Validity>(information, *space, valid));
  information->setMotionValidator(std::make_shared<Motions>(information, *space, planner));
  information->setup();

  const auto to_state = [&](const Eigen::VectorXd& q) {
    ob::ScopedState<ob::RealVectorStateSpace> state(space);
    for (unsigned i = 0; i < dimension; ++i) state[i] = q[i];
    return state;
  };
  const auto problem = std::make_shared<ob::ProblemDefinition>(information);
  problem->addStartState(to_state(start));
  const auto goal_states = std::make_shared<ob::GoalStates>(information);
  for (const Eigen::VectorXd& goal : goals) goal_states->addState(to_state(goal));
  problem->setGoal(goal_states);

  SeededRrtConnect search(information, LocalSeed(seed, "transfer planner"));
  search.setRange(planner.options().extension_m);
  search.setProblemDefinition(problem);
  // Linear nearest neighbours: trees stay small, and OMPL's default draws pivots from a generator that has no seed.
  search.setNearestNeighbors<ompl::NearestNeighborsLinear>();
  search.setup();
  ob::IterationTerminationCondition limit(static_cast<unsigned>(iterations));
  const auto& stop = planner.options().stop;
  const ob::PlannerTerminationCondition end([&] { return limit.eval() || (stop && stop()); });
  if (search.solve(end) != ob::PlannerStatus::EXACT_SOLUTION) return {};

  og::PathGeometric path(*problem->getSolutionPath()->as<og::PathGeometric>());
  SeededSimplifier simplifier(information, LocalSeed(seed, "transfer simplifier"));
  for (int round = 0; round < planner.options().simplification_rounds; ++round) {
    simplifier.reduceVertices(path);
    simplifier.shortcutPath(path, 30, 15);
  }
  simplifier.reduceVertices(path);
  std::vector<Eigen::VectorXd> way_points;
  for (const ob::State* state : path.getStates()) way_points.emplace_back(space->Values(state));
  return way_points;
}

}  // namespace feeler::planner
