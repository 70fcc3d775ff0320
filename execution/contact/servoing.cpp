#include "feeler/execution/contact/servoing.h"

#include <fmt/format.h>

#include <string>

#include "feeler/execution/contact/policy_call.h"

namespace feeler::execution {
namespace {

/// Pictures of one episode, whatever the policy.
constexpr int kPictureLimit = 10000;
constexpr double kStop_s = 0.1;

}  // namespace

policies::Decision FollowByEye(const planner::Problem& problem, const policies::Decision& first,
                               policies::Policy& policy, Mover& mover, ExecutionRecord& record) {
  const policies::Belief belief{problem.start, problem.hypotheses};
  policies::Decision decision = first;
  TwistMotion stop;
  while (const auto* servo = std::get_if<policies::Servo>(&decision)) {
    if (record.pictures >= kPictureLimit) {
      throw ExecutionFailure(fmt::format("limit: {} pictures without a verdict", record.pictures));
    }
    if (servo->motion.duration_s > 0.0) {
      if (mover.Follow(servo->motion).contact) throw LostTrack("servo: the tool touches something");
      stop.tool_T_frame = servo->motion.tool_T_frame;
    }
    const CameraView view = mover.Look();
    ++record.pictures;
    decision = CallPolicy(record, [&] {
      policy.See(view);
      return policy.Next(belief);
    });
  }
  if (const auto* give_up = std::get_if<policies::GiveUp>(&decision)) {
    throw LostTrack("policy gave up: " + give_up->reason);
  }
  stop.duration_s = kStop_s;
  mover.Follow(stop);
  return decision;
}

}  // namespace feeler::execution
