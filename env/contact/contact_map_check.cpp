#include "feeler/env/contact/contact_map_check.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "feeler/core/random.h"
#include "feeler/core/worker_pool.h"
#include "feeler/env/model/overlap_judge.h"

namespace feeler::env {
namespace {

constexpr std::int64_t kBlock = 500;  ///< probes of one random stream
constexpr double kFarthest_cells = 12.0;
/// How far behind a wall is asked at most: thin parts end.
constexpr double kBehind_cells = 0.5;

class Checker {
 public:
  Checker(const TaskModel& task_model, Opening opening, const planner::ContactMap& map, double grazing_m)
      : map_(map), cell_m_(task_model.task.cell_m), grazing_cells_(grazing_m / task_model.task.cell_m) {
    for (const Eigen::Quaterniond& orientation : TargetOrientations(task_model.task)) {
      judges_.emplace_back(task_model, GeomsOf(task_model, opening), orientation);
    }
  }

  void Probe(RandomStream& random, ContactMapCheck& check) {
    const auto orientation = static_cast<int>(random.Index(judges_.size()));
    const Direction direction = kDirections[random.Index(kDirectionCount)];
    const Cell size = map_.domain().Size();
    Cell cell = map_.domain().min;
    for (int axis = 0; axis < 3; ++axis) {
      cell[axis] += static_cast<int>(random.Index(static_cast<std::uint64_t>(size[axis])));
    }
    double along = random.Uniform(0.0, kFarthest_cells);
    const double travel = map_.Travel(cell, direction, orientation);
    const bool inside = map_.Blocked(cell, orientation);
    if (inside) {
      along = 0.0;
    } else if (along > travel) {
      along = travel + std::min(along - travel, kBehind_cells * random.Uniform());
    }
    if (!inside && std::abs(along - travel) < grazing_cells_) {
      ++check.grazing;
      return;
    }
    const Eigen::Vector3d place = cell.cast<double>() + map_.phase() + along * UnitVector(direction);
    const bool blocked = judges_[static_cast<std::size_t>(orientation)].Overlap(place * cell_m_);
    ++check.probes;
    check.blocked += blocked ? 1 : 0;
    check.disagreements += blocked != (inside || along > travel) ? 1 : 0;
  }

 private:
  const planner::ContactMap& map_;
  double cell_m_;
  double grazing_cells_;
  std::vector<OverlapJudge> judges_;
};

}  // namespace

ContactMapCheck CheckContactMap(const TaskModel& task_model, Opening opening, const planner::ContactMap& map,
                                std::int64_t probes, std::uint64_t seed, double grazing_m, Parallelism parallelism) {
  const std::int64_t blocks = (probes + kBlock - 1) / kBlock;
  ContactMapCheck sum;
  RunInOrder(
      static_cast<std::size_t>(blocks), parallelism,
      [&] {
        return [&, checker = Checker(task_model, opening, map, grazing_m)](std::size_t index) mutable {
          const auto block = static_cast<std::int64_t>(index);
          RandomStream random(seed, index, "contact-map probes");
          ContactMapCheck check;
          for (std::int64_t i = block * kBlock; i < std::min(probes, (block + 1) * kBlock); ++i) {
            checker.Probe(random, check);
          }
          return check;
        };
      },
      [&](std::size_t, const ContactMapCheck& check) {
        sum.probes += check.probes;
        sum.blocked += check.blocked;
        sum.grazing += check.grazing;
        sum.disagreements += check.disagreements;
      });
  return sum;
}

}  // namespace feeler::env
