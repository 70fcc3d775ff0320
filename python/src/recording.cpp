// Episodes at control rate: what learners are given.
#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "codec.h"
#include "common.h"
#include "episodes.h"
#include "feeler/env/robot/simulated_robot.h"
#include "feeler/evaluation/records/episode_json.h"
#include "feeler/workflow/episode/episode.h"

namespace feeler::python {
namespace {

/// What was seen of one episode, a row every control step, from the start pose on.
struct Track {
  bool begun = false;
  std::vector<double> observations, times_s;
  std::vector<std::uint8_t> motions;  ///< which kind of motion was under way: index into kMotions
  std::uint8_t motion = 0;
  std::vector<std::uint8_t> contacts;  ///< whether something was felt since the row before
  bool touched = false;
  double next_s = 0.0;  ///< when the next row is due
};
/// A net force above this is a contact, N.
constexpr double kContact_n = 5.0;
constexpr const char* kMotions[] = {"transfer", "linear_move", "guarded", "compliant", "follow_twist"};

void See(const env::SimulatedRobot& robot, Track& track) {
  if (!track.begun) return;
  env::Observation seen;
  seen.q_rad = robot.q_rad();
  seen.qd_rad_s = robot.qd_rad_s();
  seen.world_T_tool = robot.ToolPose();
  seen.raw_wrench = robot.sensor().raw();
  seen.filtered_wrench = robot.sensor().filtered();
  const std::size_t at = track.observations.size();
  track.observations.resize(at + env::kObservationSize);
  const std::span<double> row(&track.observations[at], env::kObservationSize);
  env::Flatten(seen, row);
  Saturate(row);
  track.times_s.push_back(robot.Time());
  track.motions.push_back(track.motion);
  track.contacts.push_back(std::exchange(track.touched, false) ? 1 : 0);
}

/// At every physics step: contacts are shorter than a control step.
void Watch(const env::SimulatedRobot& robot, double period_s, Track& track) {
  track.touched = track.touched || robot.sensor().raw().force_n.norm() > kContact_n;
  if (robot.Time() < track.next_s - 1e-9) return;
  while (track.next_s <= robot.Time() + 1e-9) track.next_s += period_s;
  See(robot, track);
}

/// Says which kind of motion is under way, and when the first transfer, to the start pose, is over.
class Labelled final : public Robot {
 public:
  Labelled(env::SimulatedRobot& robot, Track& track) : robot_(robot), track_(track) {}
  Pose ToolPose() const override { return robot_.ToolPose(); }
  Wrench ContactWrench() const override { return robot_.ContactWrench(); }
  void ZeroWrench() override { robot_.ZeroWrench(); }
  double Time() const override { return robot_.Time(); }
  MotionResult Transfer(const Pose& pose) override {
    track_.motion = 0;
    const MotionResult result = robot_.Transfer(pose);
    if (!std::exchange(track_.begun, true)) See(robot_, track_);
    return result;
  }
  MotionResult LinearMove(const Pose& pose, double speed_m_s, double contact_force_n) override {
    track_.motion = 1;
    return robot_.LinearMove(pose, speed_m_s, contact_force_n);
  }
  MotionResult Guarded(const GuardedMotion& motion) override {
    track_.motion = 2;
    return robot_.Guarded(motion);
  }
  MotionResult Compliant(const CompliantMotion& motion) override {
    track_.motion = 3;
    return robot_.Compliant(motion);
  }
  ContactResponse Contact(const Eigen::Vector3d& direction) const override { return robot_.Contact(direction); }
  CameraView Look() override { return robot_.Look(); }
  MotionResult FollowTwist(const TwistMotion& motion) override {
    track_.motion = 4;
    return robot_.FollowTwist(motion);
  }

 private:
  env::SimulatedRobot& robot_;
  Track& track_;
};

nb::list RecordTracks(PlanningTask& task, const nb::object& policy, const std::shared_ptr<policies::Database>& database,
                      std::int64_t first, std::int64_t episodes, std::uint64_t seed, const nb::object& extents,
                      const std::string& noise, int control_steps, CancellationToken* outer,
                      const nb::object& progress) {
  if (episodes < 1 || first < 0) throw InputError("episodes", "there are none", "give 1 or more, from 0");
  if (control_steps < 1 || control_steps > 1000) throw InputError("control_steps", "is out of range", "give 1 to 1000");
  CancellationToken own;
  CancellationToken& token = outer != nullptr ? *outer : own;
  auto raised = std::make_shared<Raised>();
  const workflow::PolicyFactory factory = FactoryFor(policy, database, {}, raised);
  const auto setup = task.Setup(1, nb::none());
  if (database) database->RequireFingerprint(setup->task().name, setup->fingerprint);
  Track track;
  workflow::EpisodeOptions options;
  options.seed = seed;
  options.family = workflow::FamilyToDrawFrom(ExtentsText(extents), database.get(), setup->task());
  options.noise = noise;
  options.wrap_robot = [&track](env::SimulatedRobot& robot) { return std::make_unique<Labelled>(robot, track); };
  const ProgressCallback report = ToProgress(progress, token);
  nb::list result;
  try {
    RunInterruptibly(token, [&] {
      workflow::EpisodeRunner runner(setup, workflow::BuildEpisodeScene(*setup), factory, options);
      env::SimulatedRobot& robot = runner.environment().robot();
      robot.SetObserver([&](const env::World&) { Watch(robot, 1e-3 * control_steps, track); }, 1e-3);
      for (std::int64_t i = 0; i < episodes && !token.cancelled(); ++i) {
        track = Track();
        const workflow::EpisodeRecord record = runner.Run(static_cast<std::uint64_t>(first + i));
        const nlohmann::ordered_json json = evaluation::ToJson(record);
        {
          const nb::gil_scoped_acquire acquired;
          const std::size_t n = track.times_s.size();
          nb::dict d;
          d["observations"] = NewArray(std::move(track.observations), {n, env::kObservationSize});
          d["times_s"] = NewArray(std::move(track.times_s), {n});
          d["contact"] = NewArray(std::move(track.contacts), {n});
          d["motions"] = NewArray(std::move(track.motions), {n});
          d["record"] = ToPython(json);
          // Of the policy's own walk: how many hypotheses explain all answers so far, and since when.
          std::vector<double> ends_s = {0.0};
          for (const execution::MoveRecord& move : record.execution.moves)
            ends_s.push_back(ends_s.back() + move.duration_s);
          nb::list decisions;
          for (const execution::DecisionRecord& decision : record.execution.decisions) {
            if (decision.attempt != 0) continue;
            const auto motions = std::min(static_cast<std::size_t>(std::max(decision.motions, 0)), ends_s.size() - 1);
            decisions.append(nb::make_tuple(ends_s[motions], decision.left.size()));
          }
          d["decisions"] = decisions;
          result.append(d);
        }
        report(i + 1, episodes);
      }
    });
  } catch (const InputError&) {
    raised->Rethrow();
    throw;
  }
  raised->Rethrow();
  return result;
}

}  // namespace

void BindRecording(nb::module_& m) {
  nb::list motions;
  for (const char* name : kMotions) motions.append(name);
  m.attr("MOTIONS") = motions;
  m.def("record_tracks", &RecordTracks, "task"_a, "policy"_a, "database"_a.none(), "first"_a, "episodes"_a, "seed"_a,
        "extents"_a.none(), "noise"_a, "control_steps"_a, "cancellation"_a.none(), "progress"_a.none());
}

}  // namespace feeler::python
