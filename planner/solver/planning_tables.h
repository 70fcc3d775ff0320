#pragma once

#include <memory>

#include "planner/belief/contact_masks.h"
#include "planner/heuristic/belief_heuristic.h"
#include "planner/heuristic/certificate_table.h"
#include "planner/heuristic/first_contact.h"
#include "planner/heuristic/lines.h"
#include "planner/heuristic/pair_certificates.h"
#include "planner/heuristic/local_certificate.h"
#include "planner/solver/solve.h"

namespace feeler::planner {

class PlanningTables {
 public:
  PlanningTables(const Problem& problem, const SolverOptions& options);

  const ContactMasks& masks() const { return masks_; }
  /// The heuristic of a belief store of `problem`; the tables and the store must outlive it.
  std::unique_ptr<BeliefHeuristic> MakeHeuristic(const Problem& problem, const HypothesisSets& sets) const;

 private:
  std::shared_ptr<const ContactMap> map_;
  ContactMasks masks_;
  std::shared_ptr<const CertificateTable> certificate_;
  std::shared_ptr<const PairCertificates> pairs_;
  std::shared_ptr<const LineTable> lines_;
  std::shared_ptr<const FirstContactTable> first_contact_;
  std::shared_ptr<const LocalCertificateTable> local_certificate_;  ///< for one problem: tables are not shared then
};

}  // namespace feeler::planner
