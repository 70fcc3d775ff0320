#include "feeler/planner/contact/contact_map.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "feeler/core/error.h"

namespace feeler::planner {

ContactMap::ContactMap(CellBox domain, std::vector<Layer> layers, Eigen::Vector3d phase, double margin_cells)
    : domain_(std::move(domain)),
      size_(domain_.Size()),
      layers_(std::move(layers)),
      phase_(std::move(phase)),
      margin_cells_(margin_cells) {
  const auto count = static_cast<std::size_t>(domain_.Count());
  if (count == 0 || layers_.empty())
    throw InputError("contact map", "empty domain or no orientation", "give a domain with cells and a layer");
  for (const Layer& layer : layers_) {
    bool fits = layer.blocked.size() == count;
    for (const auto& travel : layer.travel) fits = fits && travel.size() == count;
    if (!fits)
      throw InputError("contact map", "a layer does not have one entry per displacement of the domain",
                       "give a layer of the domain's size");
  }
}

Outcome ContactMap::Predict(const Cell& displacement, const GuardedMove& move, int orientation) const {
  const float travel = Travel(displacement, move.direction, orientation);
  const int cells = travel >= static_cast<float>(move.cells) ? move.cells : static_cast<int>(std::floor(travel));
  return {cells, cells < move.cells};
}

}  // namespace feeler::planner
