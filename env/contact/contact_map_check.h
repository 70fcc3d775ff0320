#pragma once

#include <cstdint>

#include "feeler/core/parallelism.h"
#include "feeler/env/model/task_file.h"
#include "feeler/planner/contact/contact_map.h"

namespace feeler::env {

/// How a contact map compares with MuJoCo's collision detection.
struct ContactMapCheck {
  std::int64_t probes = 0;         ///< places asked, grazing ones left out
  std::int64_t blocked = 0;        ///< of them in the target, as MuJoCo sees it
  std::int64_t grazing = 0;        ///< left out
  std::int64_t disagreements = 0;  ///< places that the map calls free and MuJoCo does not, or the other way round
  double agreement() const {
    return probes == 0 ? 0.0 : 1.0 - static_cast<double>(disagreements) / static_cast<double>(probes);
  }
};

/// Draws `probes` motions: a displacement of the lattice, an orientation, a direction. Of a displacement that the map
/// calls blocked MuJoCo is asked there; of a free one somewhere on the way, up to a cell behind the wall that the map
/// knows. Places within `grazing_m` of that wall are left out. Lattice points and the lines between them are both
/// asked. Same result at any thread count.
ContactMapCheck CheckContactMap(const TaskModel& task_model, Opening opening, const planner::ContactMap& map,
                                std::int64_t probes, std::uint64_t seed, double grazing_m = 5e-5,
                                Parallelism parallelism = {});

}  // namespace feeler::env
