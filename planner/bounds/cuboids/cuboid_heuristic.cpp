#include "feeler/planner/bounds/cuboids/cuboid_heuristic.h"

#include <algorithm>
#include <limits>
#include <map>
#include <utility>

#include "feeler/planner/belief/neighbour_masks.h"

namespace feeler::planner {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

CuboidHeuristic::CuboidHeuristic(const HypothesisSets& sets, std::shared_ptr<const CuboidTable> cuboids,
                                 std::shared_ptr<const CertificateTable> certificates,
                                 std::shared_ptr<const PairCertificates> pairs)
    : sets_(sets), cuboids_(std::move(cuboids)), certificates_(std::move(certificates)), pairs_(std::move(pairs)) {}

const CuboidHeuristic::Terms& CuboidHeuristic::Prepare(SetId set) {
  if (set >= terms_.size()) terms_.resize(sets_.count());
  if (terms_[set].ready) return terms_[set];
  NeighbourMasks(sets_, set, certificates_->neighbours(), masks_);
  struct Group {
    int lowest = 0;
    Layers layers;
    std::vector<Member> members;
  };
  std::map<std::array<int, 3>, Group> groups;  // by orientation and window
  std::size_t k = 0;
  sets_.ForEach(set, [&](const Cell& h, int orientation, std::uint32_t layer, int bit) {
    const Cell& corner = sets_.Corner(layer);
    Group& group = groups[{orientation, corner.x(), corner.y()}];
    // Slabs come in increasing order of heights.
    if (group.layers.empty()) group.lowest = h.z();
    group.layers.resize(static_cast<std::size_t>(h.z() - group.lowest + 1));
    group.layers.back().Set(bit);
    group.members.push_back({h, masks_[k++], sets_.Weight(layer, bit)});
  });
  terms_[set] = {{static_cast<std::uint32_t>(groups_.size()), static_cast<std::uint32_t>(groups.size())}, true};
  for (const auto& [key, group] : groups) {
    PrepareGroup(set, Cell(key[1], key[2], group.lowest), key[0], group.layers, group.members);
  }
  return terms_[set];
}

CuboidHeuristic::Single CuboidHeuristic::SingleOf(SetId set, const Member& member, int orientation) const {
  Single single{member.offset, orientation, member.mask, nullptr, member.weight};
  if (member.mask != 0) return single;
  if (const auto nearest = NearestToTellApart(sets_, set, member.offset, orientation, pairs_->spread())) {
    single.pair = &pairs_->Get(*nearest, orientation);
  }
  return single;
}

void CuboidHeuristic::PrepareGroup(SetId set, const Cell& corner, int orientation, const Layers& layers,
                                   const std::vector<Member>& members) {
  const auto first_partition = static_cast<std::uint32_t>(partitions_.size());
  const Cell largest = sets_.uniform() ? cuboids_->largest() : Cell(Cell::Ones());
  std::vector<std::vector<HypothesisBox>> seen;
  for (const AxisOrder& order : kAxisOrders) {
    Layers rest = layers;
    std::vector<HypothesisBox> boxes;
    PartitionIntoBoxes(rest, order, largest, boxes);
    if (std::ranges::find(seen, boxes) != seen.end()) continue;
    seen.push_back(boxes);
    const auto first_box = static_cast<std::uint32_t>(boxes_.size());
    for (HypothesisBox box : boxes) {
      box.low += corner;
      Box& added = boxes_.emplace_back();
      added = {box, orientation, {static_cast<std::uint32_t>(singles_.size()), 0}};
      if (box.size.prod() > CuboidTable::kSmallBox && !cuboids_->Goal(box.size)) continue;
      const CellBox cells{box.low, box.low + box.size - Cell::Ones()};
      for (const Member& member : members) {
        if (!cells.Contains(member.offset)) continue;
        const Single single = SingleOf(set, member, orientation);
        if (single.mask != 0 || single.pair != nullptr) singles_.push_back(single);
      }
      added.members.count = static_cast<std::uint32_t>(singles_.size()) - added.members.first;
    }
    partitions_.push_back({first_box, static_cast<std::uint32_t>(boxes.size())});
    if (boxes.size() == 1) break;
  }
  groups_.push_back({first_partition, static_cast<std::uint32_t>(partitions_.size()) - first_partition});
}

double CuboidHeuristic::Value(const Box& box, const Cell& robot) const {
  const std::uint32_t units = cuboids_->At(robot - box.box.low, box.box.size, box.orientation);
  if (units == CuboidTable::kUnreachable) return kInfinity;
  double sum = 0.0;
  for (std::uint32_t i = box.members.first; i < box.members.first + box.members.count; ++i) {
    const Single& single = singles_[i];
    const Cell displacement = robot - single.offset;
    const std::uint32_t value = single.pair != nullptr
                                    ? single.pair->At(displacement)
                                    : certificates_->Further(displacement, single.mask, single.orientation);
    if (value >= kNoCertificate) return kInfinity;
    sum += single.weight * value * (single.pair != nullptr ? single.pair->grid.unit : certificates_->grid().unit);
  }
  return std::max(sum, units * cuboids_->unit());
}

double CuboidHeuristic::Weighted(SetId set, const Cell& robot) {
  if (sets_.info(set).goal) return 0.0;
  const Terms terms = Prepare(set);
  double sum = 0.0;
  for (std::uint32_t g = terms.groups.first; g < terms.groups.first + terms.groups.count; ++g) {
    double best = 0.0;
    for (std::uint32_t i = groups_[g].first; i < groups_[g].first + groups_[g].count; ++i) {
      double value = 0.0;
      for (std::uint32_t k = partitions_[i].first; k < partitions_[i].first + partitions_[i].count; ++k) {
        value += Value(boxes_[k], robot);
      }
      best = std::max(best, value);
    }
    sum += best;
  }
  return sum;
}

double CuboidHeuristic::Estimate(SetId set, const Cell& robot) {
  const double bound = Weighted(set, robot);
  const HypothesisSets::Info& info = sets_.info(set);
  const Cell size = info.high - info.low + Cell::Ones();
  if (info.goal || (size.array() > cuboids_->largest().array()).any()) return bound;
  const std::uint32_t value = cuboids_->At(robot - info.low, size, sets_.Orientation(sets_.slabs(set).front().layer));
  if (value == CuboidTable::kUnreachable) return bound;
  return std::max(bound, info.weight * value * cuboids_->unit() / size.prod());
}

std::size_t CuboidHeuristic::bytes() const {
  return terms_.capacity() * sizeof(Terms) + groups_.capacity() * sizeof(Range) +
         partitions_.capacity() * sizeof(Range) + boxes_.capacity() * sizeof(Box) +
         singles_.capacity() * sizeof(Single);
}

}  // namespace feeler::planner
