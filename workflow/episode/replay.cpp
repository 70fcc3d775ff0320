#include "feeler/workflow/episode/replay.h"

#include <utility>

namespace feeler::workflow {
namespace {

/// Weaker contacts are not worth a mark.
constexpr double kLeastForce_n = 0.5;

}  // namespace

bool ReplayRecorder::Touches(const env::ContactForce& contact) const {
  const auto part = [&](int geom) { return scene_.geom_part[static_cast<std::size_t>(geom)]; };
  return part(contact.geom1) == env::ScenePart::kTool || part(contact.geom2) == env::ScenePart::kTool;
}

void ReplayRecorder::See(const env::World& world) {
  if (world.time_s() >= static_cast<double>(replay_.q_rad.size()) * replay_.period_s - 1e-9) {
    replay_.q_rad.push_back(world.q_rad());
  }
  const int sample = static_cast<int>(replay_.q_rad.size());
  for (const env::ContactForce& contact : world.contacts()) {
    const double force_n = contact.force_n.norm();
    if (force_n < kLeastForce_n || !Touches(contact)) continue;
    if (replay_.contacts.empty() || replay_.contacts.back().sample != sample) {
      replay_.contacts.push_back({sample, contact.point_m, force_n});
    } else if (force_n > replay_.contacts.back().force_n) {
      replay_.contacts.back() = {sample, contact.point_m, force_n};
    }
  }
}

Replay ReplayRecorder::Take(const env::World& world) {
  replay_.q_rad.push_back(world.q_rad());
  return std::exchange(replay_, {});
}

}  // namespace feeler::workflow
