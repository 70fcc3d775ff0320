#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "feeler/planner/bounds/certificates/certificate_table.h"
#include "feeler/planner/bounds/certificates/pair_certificates.h"
#include "feeler/planner/noise/noisy_belief_graph.h"

namespace feeler::planner {

/// Costs of single steps in the world that the lower bound looks at, where some steps are lost to noise and the others
/// say truly whether they were free or blocked. See docs/planner.md, "Noise".
StepCosts NoisyStepCosts(const NoisyProblem& noisy);

/// A lower bound of the optimal cost of a noisy belief: certificates (see CertificateTable) of a world that shows more,
/// over layers of equal probability, each hypothesis at most half of what being wrong costs.
class NoisyBound {
 public:
  /// The problem must outlive the bound.
  explicit NoisyBound(const NoisyProblem& noisy);

  double operator()(const Cell& robot, std::span<const WeightedHypothesis> belief);
  std::size_t bytes() const;

 private:
  double Certificate(const Cell& robot, std::uint32_t hypothesis, int mask) const;
  /// Of a hypothesis without neighbours down to the level `above`: told from the nearest other that is likelier.
  double Isolated(const Cell& robot, const WeightedHypothesis& h, std::span<const WeightedHypothesis> belief,
                  double above);

  const NoisyProblem& noisy_;
  double most_ = 0.0;  ///< of a hypothesis
  std::unique_ptr<const CertificateTable> table_;
  std::unique_ptr<const PairCertificates> pairs_;        ///< null under goal `insertable`
  std::vector<std::array<std::int32_t, 6>> neighbours_;  ///< by hypothesis; -1: none
  std::map<std::array<int, 4>, const PairCertificates::Plane*> planes_;
  std::vector<double> weight_;  ///< by hypothesis; zero between uses
};

}  // namespace feeler::planner
