#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "planner/heuristic/belief_heuristic.h"
#include "planner/heuristic/oriented_certificates.h"
#include "planner/heuristic/oriented_pairs.h"

namespace feeler::planner {

/// The certificate heuristic where hypotheses have orientations: the sum over the hypotheses of a belief of the cost to
/// tell each from those of its axis neighbours, in position and angle, that are in the belief; an isolated hypothesis,
/// which has none, from the one that is nearest in cells and angles. Admissible and consistent for the reasons that
/// CertificateTable and IsolatedHypotheses give; hypotheses of different orientation are never left together by a goal.
class OrientedHeuristic final : public BeliefHeuristic {
 public:
  OrientedHeuristic(const Problem& problem, const HypothesisSets& sets,
                    std::shared_ptr<const OrientedCertificates> table, std::shared_ptr<const OrientedPairs> pairs);
  /// Only the part of hypotheses that are isolated in position: those without a neighbour a cell away of their own
  /// orientation. To be added to bounds that count nothing for them.
  OrientedHeuristic(const Problem& problem, const HypothesisSets& sets, std::shared_ptr<const OrientedPairs> pairs);
  double Weighted(SetId set, const Cell& robot) override;
  std::size_t bytes() const override {
    return terms_of_.capacity() * sizeof(Terms) + runs_.capacity() * sizeof(Run) + weights_.capacity() * sizeof(double);
  }

 private:
  /// Hypotheses that follow one another along x and look at the same neighbours: their values lie side by side.
  struct Run {
    const std::uint8_t* values = nullptr;
    const OrientedBox* box = nullptr;
    Cell last = Cell::Zero();  ///< of greatest x, relative to the frame: it comes first in the table
    int length = 1;
  };
  struct Terms {
    std::uint32_t first = 0;
    std::uint32_t count = 0;
    bool ready = false;
  };
  struct Member {
    Cell offset = Cell::Zero();
    int orientation = 0;
    double weight = 1.0;
    unsigned neighbours = 0;
  };
  Terms Prepare(SetId set);
  void FindMembers(SetId set);
  std::optional<std::size_t> Nearest(std::size_t member) const;

  const HypothesisSets& sets_;
  std::shared_ptr<const OrientedCertificates> table_;  ///< null: isolated ones only
  std::shared_ptr<const OrientedPairs> pairs_;
  double unit_;
  Cell spread_;
  int pitches_;
  bool uniform_;
  std::vector<Terms> terms_of_;
  std::vector<Run> runs_;
  std::vector<double> weights_;  ///< of runs, unless the prior is uniform: each is one hypothesis then
  std::vector<Member> members_;  ///< of the set in work
};

}  // namespace feeler::planner
