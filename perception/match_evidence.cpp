#include "feeler/perception/match_evidence.h"

#include <algorithm>
#include <cmath>

namespace feeler::perception {
namespace {

/// Between the worst of the matches, or what is no more than noise, and the weakest of the negatives that are clearly
/// worse; no higher than where nothing is known.
double Limit(const std::vector<MatchEvidence>& matches, const std::vector<MatchEvidence>& negatives,
             double MatchEvidence::*value, double noise, double most) {
  double worst = noise;
  for (const MatchEvidence& match : matches) worst = std::max(worst, match.*value);
  constexpr double kClearly = 2.0;
  double weakest = most * most / worst;  // so that the middle is `most`
  for (const MatchEvidence& negative : negatives) {
    if (negative.*value > kClearly * worst) weakest = std::min(weakest, negative.*value);
  }
  return std::max(worst, std::min(most, std::sqrt(worst * weakest)));
}

}  // namespace

MatchLimits LimitsFrom(const std::vector<MatchEvidence>& matches, const std::vector<MatchEvidence>& negatives) {
  MatchLimits limits;
  constexpr double kBeyond = 0.05;
  constexpr double kSeenThrough = 0.01;
  constexpr double kMissing_m2 = kMet_m * kMet_m;
  limits.most_beyond = Limit(matches, negatives, &MatchEvidence::beyond, kBeyond, limits.most_beyond);
  limits.most_seen_through =
      Limit(matches, negatives, &MatchEvidence::seen_through, kSeenThrough, limits.most_seen_through);
  limits.most_missing_m2 = Limit(matches, negatives, &MatchEvidence::missing_m2, kMissing_m2, limits.most_missing_m2);
  return limits;
}

}  // namespace feeler::perception
