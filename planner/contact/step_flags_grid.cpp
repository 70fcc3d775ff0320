#include "feeler/planner/contact/step_flags_grid.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "feeler/core/worker_pool.h"

namespace feeler::planner {

StepFlagsGrid::StepFlagsGrid(const ContactMap& map, Parallelism jobs, const ArrayStore* store)
    : domain_{map.domain().min - Cell::Ones(), map.domain().max + Cell::Ones()},
      size_(domain_.Size()),
      flags_(static_cast<std::size_t>(map.orientations())),
      regions_(flags_.size()) {
  std::vector<SharedArray<std::uint8_t>*> all;
  for (auto& of_orientation : flags_) all.push_back(&of_orientation);
  const bool taken = store != nullptr && store->Take("step flags", all);
  ParallelFor(flags_.size(), jobs, [&](std::size_t o) {
    if (!taken) {
      std::vector<std::uint8_t> flags;
      flags.reserve(static_cast<std::size_t>(domain_.Count()));
      ForEachCell(domain_, [&](const Cell& here) { flags.push_back(StepFlags(map, here, static_cast<int>(o))); });
      flags_[o] = std::move(flags);
    }
    regions_[o] = Active(static_cast<int>(o));
  });
  if (!taken && store != nullptr) store->Keep("step flags", all);
}

/// True if `holds` of every cell of the layer `at` of a box.
template <class F>
bool StepFlagsGrid::AllOfLayer(CellBox box, int axis, int at, F holds) const {
  box.min[axis] = at;
  box.max[axis] = at;
  for (int z = box.min.z(); z <= box.max.z(); ++z) {
    for (int y = box.min.y(); y <= box.max.y(); ++y) {
      for (int x = box.min.x(); x <= box.max.x(); ++x) {
        if (!holds(Cell(x, y, z))) return false;
      }
    }
  }
  return true;
}

StepFlagsGrid::Region StepFlagsGrid::Active(int orientation) const {
  Region region{domain_, {}, {}};
  CellBox& box = region.box;
  const auto repeats = [&](int axis, int at, int other) {
    return AllOfLayer(box, axis, at, [&](const Cell& here) {
      Cell there = here;
      there[axis] = other;
      return At(here, orientation) == At(there, orientation);
    });
  };
  const auto free = [&](int axis, int at) {
    return AllOfLayer(box, axis, at, [&](const Cell& here) { return At(here, orientation) == 0; });
  };
  for (int axis = 0; axis < 3; ++axis) {
    while (box.max[axis] > box.min[axis] && repeats(axis, box.max[axis], box.max[axis] - 1)) --box.max[axis];
    while (box.max[axis] > box.min[axis] && repeats(axis, box.min[axis], box.min[axis] + 1)) ++box.min[axis];
  }
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    region.free_above[i] = free(axis, box.max[axis]);
    region.free_below[i] = free(axis, box.min[axis]);
  }
  return region;
}

StepFlagsGrid::Region StepFlagsGrid::Union(const Region& a, const Region& b) {
  Region both{{a.box.min.cwiseMin(b.box.min), a.box.max.cwiseMax(b.box.max)}, {}, {}};
  for (std::size_t i = 0; i < 3; ++i) {
    both.free_above[i] = a.free_above[i] && b.free_above[i];
    both.free_below[i] = a.free_below[i] && b.free_below[i];
  }
  return both;
}

void StepFlagsGrid::Copy(const CellBox& box, int orientation, std::span<std::uint8_t> flags) const {
  const SharedArray<std::uint8_t>& grid = flags_[static_cast<std::size_t>(orientation)];
  auto to = flags.begin();
  for (int z = box.min.z(); z <= box.max.z(); ++z) {
    for (int y = box.min.y(); y <= box.max.y(); ++y) {
      const Cell first = domain_.Clamp(Cell(domain_.min.x(), y, z)) - domain_.min;
      const std::uint8_t* const row = grid.data() + GridIndex(size_, first);
      for (int x = box.min.x(); x <= box.max.x(); ++x, ++to) {
        *to = row[std::clamp(x, domain_.min.x(), domain_.max.x()) - domain_.min.x()];
      }
    }
  }
}

}  // namespace feeler::planner
