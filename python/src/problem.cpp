// Contact maps and problems as arrays.
#include <fmt/format.h>

#include "feeler/planner/belief/lattice_problem.h"
#include "feeler/policies/io/lattice_problem_file.h"
#include "planner.h"

namespace feeler::python {
namespace {

nb::object TravelOf(const planner::ContactMap& map, int direction, int orientation) {
  const Cell size = map.domain().Size();
  const auto& values = map.layer(orientation).travel[static_cast<std::size_t>(direction)];
  // x fastest in the map: (z, y, x) in rows, handed out as (x, y, z).
  std::vector<float> copy(values.size());
  const auto nx = static_cast<std::size_t>(size.x());
  const auto ny = static_cast<std::size_t>(size.y());
  const auto nz = static_cast<std::size_t>(size.z());
  for (std::size_t z = 0; z < nz; ++z) {
    for (std::size_t y = 0; y < ny; ++y) {
      for (std::size_t x = 0; x < nx; ++x) copy[(x * ny + y) * nz + z] = values[(z * ny + y) * nx + x];
    }
  }
  return NewArray(std::move(copy), {nx, ny, nz});
}

void RequireOrientation(const planner::ContactMap& map, int orientation) {
  if (orientation < 0 || orientation >= map.orientations()) {
    throw InputError("orientation", fmt::format("{} of {}", orientation, map.orientations()), "count from 0");
  }
}

nb::object CellsOf(const std::vector<planner::Hypothesis>& hypotheses) {
  std::vector<std::int32_t> rows;
  for (const planner::Hypothesis& h : hypotheses) {
    for (int axis = 0; axis < 3; ++axis) rows.push_back(h.offset[axis]);
    rows.push_back(h.orientation);
  }
  return NewArray(std::move(rows), {hypotheses.size(), 4});
}

void BindMap(nb::module_& m) {
  nb::class_<planner::ContactMap>(m, "ContactMap", "How far the tool can travel from each displacement to the target.")
      .def_prop_ro("shape", [](const planner::ContactMap& map) { return Eigen::Vector3i(map.domain().Size()); })
      .def_prop_ro("origin", [](const planner::ContactMap& map) { return Eigen::Vector3i(map.domain().min); })
      .def_prop_ro("phase", [](const planner::ContactMap& map) { return map.phase(); })
      .def_prop_ro("margin_cells", &planner::ContactMap::margin_cells)
      .def_prop_ro("orientations", &planner::ContactMap::orientations)
      .def(
          "travel",
          [](const planner::ContactMap& map, const std::string& direction, int orientation) {
            RequireOrientation(map, orientation);
            return TravelOf(map, IndexOf(ToDirection(direction)), orientation);
          },
          "direction"_a, "orientation"_a = 0)
      .def(
          "blocked",
          [](const planner::ContactMap& map, int orientation) {
            RequireOrientation(map, orientation);
            const Cell size = map.domain().Size();
            const std::size_t count = static_cast<std::size_t>(map.domain().Count());
            bool* data = new bool[count];
            std::size_t at = 0;
            for (int x = 0; x < size.x(); ++x) {
              for (int y = 0; y < size.y(); ++y) {
                for (int z = 0; z < size.z(); ++z)
                  data[at++] = map.Blocked(map.domain().min + Cell(x, y, z), orientation);
              }
            }
            nb::capsule owner(data, [](void* p) noexcept { delete[] static_cast<bool*>(p); });
            const std::size_t shape[3] = {static_cast<std::size_t>(size.x()), static_cast<std::size_t>(size.y()),
                                          static_cast<std::size_t>(size.z())};
            return nb::ndarray<nb::numpy, bool>(data, 3, shape, owner);
          },
          "orientation"_a = 0);
}

}  // namespace

void BindProblem(nb::module_& m) {
  BindMap(m);
  nb::class_<planner::Problem>(m, "Problem", "A start belief and everything needed to plan from it.")
      .def_ro("name", &planner::Problem::name)
      .def_prop_ro("start", [](const planner::Problem& p) { return Eigen::Vector3i(p.start); })
      .def_prop_ro("hypotheses", [](const planner::Problem& p) { return CellsOf(p.hypotheses); })
      .def_prop_ro("weights",
                   [](const planner::Problem& p) {
                     std::vector<double> weights;
                     for (const planner::Hypothesis& h : p.hypotheses) weights.push_back(h.weight);
                     const std::size_t n = weights.size();
                     return NewArray(std::move(weights), {n});
                   })
      .def_ro("move_lengths", &planner::Problem::move_lengths)
      .def_prop_ro("goal", [](const planner::Problem& p) { return std::string(ToString(p.goal)); })
      .def_prop_ro("workspace",
                   [](const planner::Problem& p) {
                     return nb::make_tuple(Eigen::Vector3i(p.workspace.min), Eigen::Vector3i(p.workspace.max));
                   })
      .def_prop_ro("contact_map", [](const planner::Problem& p) { return p.map; })
      .def(
          "outcome",
          [](const planner::Problem& p, const Eigen::Vector3i& robot, const std::string& direction, int cells,
             int hypothesis) {
            if (cells < 1) throw InputError("cells", fmt::format("is {}", cells), "give 1 or more");
            if (hypothesis < 0 || hypothesis >= static_cast<int>(p.hypotheses.size())) {
              throw InputError("hypothesis", fmt::format("{} of {}", hypothesis, p.hypotheses.size()), "count from 0");
            }
            const Outcome o = planner::Simulate(p, robot, {ToDirection(direction), cells},
                                                p.hypotheses[static_cast<std::size_t>(hypothesis)]);
            return nb::make_tuple(o.cells, o.contact);
          },
          "robot"_a, "direction"_a, "cells"_a, "hypothesis"_a,
          "What a guarded move from a cell returns under a hypothesis: (cells, contact).");
  m.def(
      "lattice_problem",
      [](const std::string& json) {
        return std::make_shared<const planner::Problem>(
            planner::MakeLatticeProblem(policies::ParseLatticeProblem(json, "lattice problem")));
      },
      "json"_a);
  m.def(
      "read_lattice_problem",
      [](const std::string& path) {
        return std::make_shared<const planner::Problem>(
            planner::MakeLatticeProblem(policies::ReadLatticeProblem(path)));
      },
      "path"_a);
}

}  // namespace feeler::python
