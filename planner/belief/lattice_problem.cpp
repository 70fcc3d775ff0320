#include "feeler/planner/belief/lattice_problem.h"

#include <fmt/format.h>

#include <utility>

#include "feeler/core/error.h"
#include "feeler/planner/belief/hull.h"

namespace feeler::planner {
namespace {

constexpr std::int64_t kMostDisplacements = std::int64_t{1} << 26;

/// Blocked displacements are the differences target cell - tool cell; travel counts the free cells before the next one.
ContactMap::Layer MakeLayer(const LatticeProblemData& data, const CellBox& domain) {
  const Cell size = domain.Size();
  const auto index = [&](const Cell& c) {
    const Cell o = c - domain.min;
    return static_cast<std::size_t>((std::int64_t{o.z()} * size.y() + o.y()) * size.x() + o.x());
  };
  const auto count = static_cast<std::size_t>(domain.Count());
  ContactMap::Layer layer;
  layer.blocked.assign(count, 0);
  for (const Cell& target : data.target) {
    for (const Cell& tool : data.tool) {
      const Cell displacement = target - tool;
      if (domain.Contains(displacement)) layer.blocked[index(displacement)] = 1;
    }
  }
  for (const Direction d : kDirections) {
    std::vector<float>& travel = layer.travel[IndexOf(d)];
    travel.assign(count, ContactMap::kUnlimited);
    const Cell step = UnitCell(d);
    // Visit cells against the direction, so that the next cell along it is known.
    const bool ascending = SignOf(d) < 0;
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t i = ascending ? k : count - 1 - k;
      const auto ix = static_cast<int>(i % static_cast<std::size_t>(size.x()));
      const auto iy = static_cast<int>(i / static_cast<std::size_t>(size.x()) % static_cast<std::size_t>(size.y()));
      const auto iz = static_cast<int>(i / static_cast<std::size_t>(size.x()) / static_cast<std::size_t>(size.y()));
      const Cell next = domain.min + Cell(ix, iy, iz) + step;
      if (layer.blocked[i] != 0) {
        travel[i] = 0.0F;
      } else if (domain.Contains(next)) {
        const std::size_t j = index(next);
        if (layer.blocked[j] != 0) {
          travel[i] = 0.0F;
        } else if (travel[j] < ContactMap::kUnlimited) {
          travel[i] = travel[j] + 1.0F;
        }
      }
    }
  }
  return layer;
}

}  // namespace

Problem MakeLatticeProblem(const LatticeProblemData& data) {
  const std::string where = data.name.empty() ? "lattice problem" : "lattice problem " + data.name;
  if (data.noise.any()) {
    throw InputError(where, "has noise, which this use of it does not know",
                     "feeler solve and feeler export do; else leave noise out");
  }
  if ((data.size.array() <= 0).any())
    throw InputError(where, "size is not positive", "give three counts of at least 1");
  if (data.tool.empty()) throw InputError(where, "the tool has no cells", "give at least one");
  if (data.target.empty()) throw InputError(where, "the target has no cells", "give at least one");
  if (data.hypotheses.empty()) throw InputError(where, "no hypotheses", "give at least one");
  constexpr int kMostOffset = 100000;
  for (const Hypothesis& h : data.hypotheses) {
    if (h.orientation != 0) throw InputError(where, "a hypothesis has an orientation", "lattice files have none");
  }
  const auto [low, high] = HullOf(data.hypotheses);
  if ((data.size.array() > kMostOffset).any() || (low.array() < -kMostOffset).any() ||
      (high.array() > kMostOffset).any()) {
    throw InputError(where, "size or hypotheses out of range", fmt::format("at most {} cells", kMostOffset));
  }
  const CellBox workspace{Cell::Zero(), data.size - Cell::Ones()};
  if (!workspace.Contains(data.start))
    throw InputError(where, "the start lies outside the size", "start inside the size");
  const CellBox domain{workspace.min - high, workspace.max - low};
  if (domain.Count() > kMostDisplacements) {
    throw InputError(where, fmt::format("{} displacements of the tool are too many", domain.Count()),
                     fmt::format("size plus spread of the hypotheses may span {} cells", kMostDisplacements));
  }
  Problem problem;
  problem.name = data.name;
  std::vector<ContactMap::Layer> layers;
  layers.push_back(MakeLayer(data, domain));
  problem.map = std::make_shared<ContactMap>(domain, std::move(layers), Eigen::Vector3d::Zero(), 0.5);
  problem.start = data.start;
  problem.hypotheses = data.hypotheses;
  problem.move_lengths = data.move_lengths;
  problem.cost = data.cost;
  problem.goal = data.goal;
  problem.insertable_spread = data.insertable_spread;
  problem.workspace = workspace;
  Validate(problem);
  return problem;
}

}  // namespace feeler::planner
