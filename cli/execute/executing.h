#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "feeler/cli/common/session.h"
#include "feeler/cli/execute/flags.h"
#include "feeler/cli/execute/operator.h"
#include "feeler/execution/executor.h"
#include "feeler/execution/records/episode_line.h"
#include "feeler/execution/recovery/online_planner.h"
#include "feeler/execution/remote/cell_file.h"
#include "feeler/execution/remote/dialler.h"
#include "feeler/execution/remote/remote_robot.h"
#include "feeler/planner/family/problem_family.h"
#include "feeler/policies/online_policy.h"
#include "feeler/policies/storage/database.h"
#include "feeler/policies/storage/task_bundle.h"

namespace feeler::cli {

/// One episode as `feeler execute` saw it.
struct ExecutedEpisode {
  execution::EpisodeLine line;
  execution::ExecutionRecord execution;
  bool link_lost = false;
  double robot_s = 0.0;  ///< on the robot's clock, the transfer to the start pose included
  double wall_s = 0.0;   ///< the same on this computer's
};

/// Episodes on whatever speaks the wire protocol.
class Executing {
 public:
  /// Opens database and bundle, and the way to the robot. Throws InputError or WorldError.
  Executing(const ExecuteFlags& flags, const Session& session);

  /// What is at the other end.
  const execution::WelcomeReply& welcome() const { return robot_->welcome(); }
  /// How many episodes are to be run, at most.
  std::int64_t most() const;
  /// The operator's start, where one is needed.
  void Start();
  /// The next one; empty where the simulation offers no more, and where a robot can do no more.
  std::optional<ExecutedEpisode> RunNext();
  /// Throws what ended the work of a robot that is no simulation: InputError if it said what cannot be, else
  /// WorldError.
  void RequireSound() const;
  void Bye() { robot_->Bye(); }

 private:
  static std::string UtcNow();
  execution::RemoteOptions WayToRobot() const;
  bool Redial();
  /// Asks the operator until a protective stop is recovered from. Throws NegativeResult where nobody does.
  void RecoverIfStopped();
  std::optional<execution::EpisodeReply> Told();
  execution::EpisodeReply ToldByOperator() const;
  std::unique_ptr<policies::Policy> PolicyFor(const planner::Extents& extents);
  /// The task's, or what the sensor needs. Throws InputError where that is far more.
  double BudgetFor(double contact_threshold_n) const;
  execution::ExecutorOptions OptionsFor(const execution::EpisodeReply& told, bool angles) const;
  execution::SafetyLimits LimitsFor(const execution::ExecutorOptions& options);
  void FindArm();
  void Judge(const execution::EpisodeReply& told, ExecutedEpisode& episode);
  void ShowMotion(const execution::ExecutionRecord& record) const;

  const ExecuteFlags& flags_;
  const Session& session_;
  Operator operator_;
  execution::CellFile cell_;
  policies::Database database_;
  policies::TaskBundle bundle_;
  std::map<planner::Extents, std::shared_ptr<const planner::PolicyGraph>> stored_;
  std::shared_ptr<planner::PlanningTablesCache> tables_ = std::make_shared<planner::PlanningTablesCache>();
  std::shared_ptr<execution::OnlinePlanner> online_planner_ = std::make_shared<execution::OnlinePlanner>();
  std::unique_ptr<execution::Dialler> dialler_;
  std::unique_ptr<execution::RemoteRobot> robot_;
  std::optional<execution::ArmCheck> arm_;
  std::optional<planner::Extents> asked_;  ///< --extents
  std::string begun_ = UtcNow();           ///< when this object was made
  bool started_ = false;
  std::int64_t done_ = 0;
};

}  // namespace feeler::cli
