#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "feeler/planner/belief/belief_heuristic.h"
#include "feeler/planner/bounds/certificates/certificate_table.h"
#include "feeler/planner/bounds/certificates/pair_certificates.h"
#include "feeler/planner/bounds/cuboids/box_partition.h"
#include "feeler/planner/bounds/cuboids/cuboid_table.h"

namespace feeler::planner {

/// The tightest bound: hypotheses are cut into boxes, each bounded by its entry of the CuboidTable; small boxes (single
/// hypotheses, if the prior is not uniform) by the certificates of their members too, which look beyond the box. Of the
/// partitions that the six orders of axes give the best counts. Admissible; consistency is not promised: cuts of a set
/// and of its parts may differ.
class CuboidHeuristic final : public BeliefHeuristic {
 public:
  CuboidHeuristic(const HypothesisSets& sets, std::shared_ptr<const CuboidTable> cuboids,
                  std::shared_ptr<const CertificateTable> certificates, std::shared_ptr<const PairCertificates> pairs);
  double Weighted(SetId set, const Cell& robot) override;
  /// Sets that are no box are bounded loosely, which makes a greedy choice love them. As a guess they cost as much per
  /// hypothesis as the box around them.
  double Estimate(SetId set, const Cell& robot) override;
  std::size_t bytes() const override;

 private:
  struct Single {
    Cell offset = Cell::Zero();
    int orientation = 0;
    int mask = 0;                                   ///< which neighbours are in the set
    const PairCertificates::Plane* pair = nullptr;  ///< of the nearest other, if none is
    double weight = 1.0;
  };
  struct Range {
    std::uint32_t first = 0;
    std::uint32_t count = 0;
  };
  /// A small box has its members beside it: the better of both bounds counts. A goal has nothing else.
  struct Box {
    HypothesisBox box;
    int orientation = 0;
    Range members;
  };
  struct Terms {
    Range groups;
    bool ready = false;
  };
  struct Member {
    Cell offset = Cell::Zero();
    std::uint8_t mask = 0;
    double weight = 1.0;
  };
  using Layers = std::vector<Bits256>;

  const Terms& Prepare(SetId set);
  void PrepareGroup(SetId set, const Cell& corner, int orientation, const Layers& layers,
                    const std::vector<Member>& members);
  Single SingleOf(SetId set, const Member& member, int orientation) const;
  double Value(const Box& box, const Cell& robot) const;

  const HypothesisSets& sets_;
  std::shared_ptr<const CuboidTable> cuboids_;
  std::shared_ptr<const CertificateTable> certificates_;
  std::shared_ptr<const PairCertificates> pairs_;
  std::vector<Terms> terms_;
  /// Hypotheses of one orientation in one window of x and y: ranges of partitions, each a way to cut them.
  std::vector<Range> groups_;
  std::vector<Range> partitions_;  ///< of boxes
  std::vector<Box> boxes_;
  std::vector<Single> singles_;
  std::vector<std::uint8_t> masks_;
};

}  // namespace feeler::planner
