#include "feeler/planner/contact/active_region.h"

#include <algorithm>

namespace feeler::planner {
namespace {

/// True if `holds` of every cell of a box.
template <class F>
bool All(const CellBox& box, F holds) {
  for (int z = box.min.z(); z <= box.max.z(); ++z) {
    for (int y = box.min.y(); y <= box.max.y(); ++y) {
      for (int x = box.min.x(); x <= box.max.x(); ++x) {
        if (!holds(Cell(x, y, z))) return false;
      }
    }
  }
  return true;
}

CellBox Layer(CellBox box, int axis, int at) {
  box.min[axis] = at;
  box.max[axis] = at;
  return box;
}

}  // namespace

std::uint8_t StepFlags(const ContactMap& map, const Cell& displacement, int orientation) {
  if (map.Blocked(displacement, orientation) && std::ranges::none_of(kDirections, [&](Direction d) {
        const Cell before = displacement - UnitCell(d);
        return !map.Blocked(before, orientation) && map.StepFree(before, d, orientation);
      })) {
    return kOutOfReach;
  }
  unsigned flags = 0;
  for (const Direction d : kDirections) {
    if (!map.StepFree(displacement, d, orientation)) flags |= 1U << IndexOf(d);
  }
  return static_cast<std::uint8_t>(flags);
}

ActiveRegion::ActiveRegion(const ContactMap& map) : box(map.domain()), whole(map.domain()) {
  const auto flags = [&](const Cell& here, int o) -> unsigned { return StepFlags(map, here, o); };
  const auto same = [&](int axis, int at, int other) {
    return All(Layer(box, axis, at), [&](const Cell& here) {
      Cell there = here;
      there[axis] = other;
      for (int o = 0; o < map.orientations(); ++o) {
        if (flags(here, o) != flags(there, o)) return false;
      }
      return true;
    });
  };
  const auto free = [&](int axis, int at) {
    return All(Layer(box, axis, at), [&](const Cell& here) {
      for (int o = 0; o < map.orientations(); ++o) {
        if (flags(here, o) != 0) return false;
      }
      return true;
    });
  };
  for (int axis = 0; axis < 3; ++axis) {
    while (box.max[axis] > box.min[axis] && same(axis, box.max[axis], box.max[axis] - 1)) --box.max[axis];
    while (box.max[axis] > box.min[axis] && same(axis, box.min[axis], box.min[axis] + 1)) ++box.min[axis];
  }
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    free_above[i] = free(axis, box.max[axis]);
    free_below[i] = free(axis, box.min[axis]);
    const unsigned up = 2U * static_cast<unsigned>(axis);  // bits of the directions +axis and -axis
    mirrored[i] = All(box, [&](const Cell& here) {
      Cell there = here;
      there[axis] = box.min[axis] + box.max[axis] - here[axis];
      for (int o = 0; o < map.orientations(); ++o) {
        const unsigned far = flags(there, o);
        if (((far & ~(3U << up)) | (far >> up & 1U) << (up + 1) | (far >> (up + 1) & 1U) << up) != flags(here, o)) {
          return false;
        }
      }
      return true;
    });
  }
}

}  // namespace feeler::planner
