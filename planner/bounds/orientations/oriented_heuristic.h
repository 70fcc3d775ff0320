#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "feeler/planner/belief/belief_heuristic.h"
#include "feeler/planner/bounds/orientations/oriented_certificates.h"
#include "feeler/planner/bounds/orientations/oriented_lines.h"
#include "feeler/planner/bounds/orientations/oriented_pairs.h"

namespace feeler::planner {

/// The certificate heuristic where hypotheses have orientations: the sum over the hypotheses of a belief of the cost to
/// tell each from those of its axis neighbours, in position and angle, that are in the belief; an isolated hypothesis,
/// which has none, from the one that is nearest in cells and angles. Admissible and consistent for the reasons that
/// CertificateTable and IsolatedHypotheses give; hypotheses of different orientation are never left together by a goal.
///
/// With lines (and a uniform prior), hypotheses at one place are parted by pitch into lines of yaw, and by yaw into
/// lines of pitch; a line costs at least what it costs alone (OrientedLines) and at least its certificates, a place at
/// least what either parting costs. Which line a hypothesis is on does not depend on the belief, so each line's bound
/// is consistent by itself, and sums and maxima of such bounds are.
class OrientedHeuristic final : public BeliefHeuristic {
 public:
  OrientedHeuristic(const Problem& problem, const HypothesisSets& sets,
                    std::shared_ptr<const OrientedCertificates> table, std::shared_ptr<const OrientedPairs> pairs,
                    std::shared_ptr<const OrientedLines> lines = nullptr);
  /// Only the part of hypotheses that are isolated in position: those without a neighbour a cell away of their own
  /// orientation. To be added to bounds that count nothing for them.
  OrientedHeuristic(const Problem& problem, const HypothesisSets& sets, std::shared_ptr<const OrientedPairs> pairs);
  double Weighted(SetId set, const Cell& robot) override;
  /// What is prepared for sets is forgotten when it has grown to so many bytes; sets that are met again are prepared
  /// again.
  void LimitPrepared(std::size_t bytes) { most_prepared_bytes_ = bytes; }
  std::size_t bytes() const override { return terms_of_.capacity() * sizeof(Terms) + PreparedBytes(); }

 private:
  /// Hypotheses that follow one another along x and look at the same neighbours: their values lie side by side.
  struct Run {
    OrientedCertificates::Plane values;
    const std::uint8_t* pair = nullptr;  ///< of an isolated hypothesis, in place of values
    const OrientedBox* box = nullptr;
    Cell last = Cell::Zero();  ///< of greatest x, relative to the frame: it comes first in the table
    int length = 1;
    std::uint32_t member = 0;  ///< of least x
  };
  /// Members at one place that are on one line, or one member that is on a line alone.
  struct Group {
    OrientedLines::Plane values;  ///< none: certificates only
    const OrientedBox* box = nullptr;
    std::uint32_t first = 0;  ///< of its members, in grouped_
    std::uint32_t count = 0;
  };
  struct Place {
    Cell offset = Cell::Zero();
    std::uint32_t first = 0;  ///< of its groups: those by yaw, then those by pitch
    std::array<std::uint32_t, OrientedLines::kAxes> count{};
  };
  struct Terms {
    std::uint32_t first = 0;
    std::uint32_t count = 0;
    std::uint32_t first_place = 0;
    std::uint32_t places = 0;  ///< 0: no lines
    std::uint32_t members = 0;
    bool ready = false;
  };
  struct Member {
    Cell offset = Cell::Zero();
    int orientation = 0;
    double weight = 1.0;
    unsigned neighbours = 0;
  };
  Terms Prepare(SetId set);
  std::size_t PreparedBytes() const;
  void Forget();
  void FindMembers(SetId set);
  void FindGroups(SetId set, Terms& terms);
  std::optional<std::size_t> Nearest(std::size_t member) const;
  const OrientedPairs::Plane& PairPlane(const Member& one, const Member& other);
  bool CostsOfMembers(const Terms& terms, const Cell& robot);
  std::optional<std::uint64_t> SumOverPlaces(const Terms& terms, const Cell& robot) const;

  const HypothesisSets& sets_;
  std::shared_ptr<const OrientedCertificates> table_;  ///< null: isolated ones only
  std::shared_ptr<const OrientedPairs> pairs_;
  std::shared_ptr<const OrientedLines> lines_;  ///< null: none
  double unit_;
  Cell spread_;
  int pitches_;
  bool uniform_;
  std::size_t most_prepared_bytes_ = std::size_t{256} << 20;
  std::map<std::array<int, 5>, std::shared_ptr<const OrientedPairs::Plane>> pair_planes_;  ///< that runs point into
  std::vector<Terms> terms_of_;
  std::vector<Run> runs_;
  std::vector<double> weights_;  ///< of runs, unless the prior is uniform: each is one hypothesis then
  std::vector<Place> places_;
  std::vector<Group> groups_;
  std::vector<std::uint32_t> grouped_;
  std::vector<Member> members_;                         ///< of the set in work
  std::vector<std::pair<int, std::uint32_t>> on_line_;  ///< members at one place by their line, in work
  std::vector<std::uint32_t> costs_;  ///< of the members, where the tool is, in units of the certificates
};

}  // namespace feeler::planner
