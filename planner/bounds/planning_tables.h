#pragma once

#include <cstddef>
#include <memory>
#include <optional>

#include "feeler/planner/arrays/array_store.h"
#include "feeler/planner/belief/belief_heuristic.h"
#include "feeler/planner/belief/contact_masks.h"
#include "feeler/planner/bounds/build_tables.h"
#include "feeler/planner/bounds/certificates/certificate_table.h"
#include "feeler/planner/bounds/certificates/first_contact.h"
#include "feeler/planner/bounds/certificates/local_certificate.h"
#include "feeler/planner/bounds/certificates/pair_certificates.h"
#include "feeler/planner/bounds/cuboids/cuboid_table.h"
#include "feeler/planner/bounds/lines/lines.h"
#include "feeler/planner/bounds/openings/look_table.h"
#include "feeler/planner/bounds/openings/openings.h"
#include "feeler/planner/bounds/orientations/oriented_heuristic.h"

namespace feeler::planner {

class PlanningTables {
 public:
  /// `store`: its key stands for problem and options.
  PlanningTables(const Problem& problem, const SolverOptions& options, Parallelism jobs = {},
                 const std::optional<ArrayStore>& store = std::nullopt);

  const ContactMasks& masks() const { return masks_; }
  /// Memory of all tables, those for the filled map included, as they stand: pairs are tabled when first asked for.
  std::size_t bytes() const;
  /// From now on heuristics are this share, in (0, 1], of what they would be: what their strength is worth. Before the
  /// tables are shared.
  void WeakenHeuristics(double share) { heuristic_share_ = share; }
  /// The heuristic of a belief store of `problem`; the tables and the store must outlive it.
  std::unique_ptr<BeliefHeuristic> MakeHeuristic(const Problem& problem, const HypothesisSets& sets) const;

  /// The map with its dead ends filled (see FillDeadEnds), the tables for it and where it was filled; the map is null
  /// if it has none, and where they are not made: that is for tasks, one orientation and the certified solver.
  struct Filled {
    std::shared_ptr<const ContactMap> map;
    std::shared_ptr<const PlanningTables> tables;
    Openings openings;
    std::shared_ptr<const LookTable> looks;
  };
  const Filled& filled() const { return filled_; }

 private:
  std::unique_ptr<BeliefHeuristic> MakeFullHeuristic(const Problem& problem, const HypothesisSets& sets) const;
  /// That of the map as it is, without what is known of its dead ends.
  std::unique_ptr<BeliefHeuristic> MakeHeuristicAsIs(const Problem& problem, const HypothesisSets& sets) const;
  void FillDeadEndsOf(const Problem& problem, const SolverOptions& options, Parallelism jobs, const ArrayStore* store);

  double heuristic_share_ = 1.0;
  ContactMasks masks_;
  std::shared_ptr<const CertificateTable> certificate_;
  std::shared_ptr<const PairCertificates> pairs_;
  std::shared_ptr<const StepFlagsGrid> flags_;
  std::shared_ptr<const OrientedCertificates> oriented_;  ///< with their pairs, where the target has orientations
  std::shared_ptr<const OrientedPairs> oriented_pairs_;
  std::shared_ptr<const OrientedLines> oriented_lines_;
  std::shared_ptr<const CuboidTable> cuboids_;
  std::shared_ptr<const LineTable> lines_;
  std::shared_ptr<const FirstContactTable> first_contact_;
  std::shared_ptr<const LocalCertificateTable> local_certificate_;  ///< for one problem: tables are not shared then
  Filled filled_;
};

}  // namespace feeler::planner
