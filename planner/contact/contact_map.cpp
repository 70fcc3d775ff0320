#include "feeler/planner/contact/contact_map.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "feeler/core/error.h"

namespace feeler::planner {

ContactMap::ContactMap(CellBox domain, std::vector<Layer> layers, Eigen::Vector3d phase, double margin_cells)
    : ContactMap(std::move(domain), {}, nullptr, std::move(phase), margin_cells, Unchecked()) {
  auto owner = std::make_shared<const std::vector<Layer>>(std::move(layers));
  for (const Layer& layer : *owner) {
    LayerView& view = layers_.emplace_back();
    view.blocked = layer.blocked;
    std::ranges::copy(layer.travel, view.travel.begin());
  }
  owner_ = std::move(owner);
  Check();
}

ContactMap::ContactMap(CellBox domain, std::vector<LayerView> layers, std::shared_ptr<const void> owner,
                       Eigen::Vector3d phase, double margin_cells)
    : ContactMap(std::move(domain), std::move(layers), std::move(owner), std::move(phase), margin_cells, Unchecked()) {
  Check();
}

ContactMap::ContactMap(CellBox domain, std::vector<LayerView> layers, std::shared_ptr<const void> owner,
                       Eigen::Vector3d phase, double margin_cells, Unchecked /*tag*/)
    : domain_(std::move(domain)),
      size_(domain_.Size()),
      layers_(std::move(layers)),
      owner_(std::move(owner)),
      phase_(std::move(phase)),
      margin_cells_(margin_cells) {}

void ContactMap::Check() const {
  const auto count = static_cast<std::size_t>(domain_.Count());
  if (count == 0 || layers_.empty())
    throw InputError("contact map", "empty domain or no orientation", "give a domain with cells and a layer");
  for (const LayerView& layer : layers_) {
    bool fits = layer.blocked.size() == count;
    for (const auto& travel : layer.travel) fits = fits && travel.size() == count;
    if (!fits)
      throw InputError("contact map", "a layer does not have one entry per displacement of the domain",
                       "give a layer of the domain's size");
  }
}

ContactMap::Layer ContactMap::CopyOfLayer(int orientation) const {
  const LayerView& view = layer(orientation);
  Layer copy;
  copy.blocked.assign(view.blocked.begin(), view.blocked.end());
  for (std::size_t d = 0; d < view.travel.size(); ++d) {
    copy.travel[d].assign(view.travel[d].begin(), view.travel[d].end());
  }
  return copy;
}

Outcome ContactMap::Predict(const Cell& displacement, const GuardedMove& move, int orientation) const {
  const float travel = Travel(displacement, move.direction, orientation);
  const int cells = travel >= static_cast<float>(move.cells) ? move.cells : static_cast<int>(std::floor(travel));
  return {cells, cells < move.cells};
}

}  // namespace feeler::planner
