#pragma once

#include <vector>

namespace feeler::perception {

/// A measured point nearer than this to the model, or a point of the model to a measured one, is met.
inline constexpr double kMet_m = 0.012;

/// What speaks for and against a match of the model with what is seen.
struct MatchEvidence {
  /// Share of the model's visible points that have a measured point near (12 mm), 0..1.
  double fitness = 0.0;
  double explained = 0.0;  ///< share of the cluster's points that lie near the model, 0..1
  /// Of the places beyond the edges of the model's faces, 12 to 40 mm out, the share where the scene carries the face
  /// on, 0..1: it is something larger. A corner of something much larger carries on half of them.
  double beyond = 0.0;
  /// Share of the model's visible points that the camera sees through, 0..1: what it measured there lies behind. What
  /// is hidden, or was not measured, is no evidence.
  double seen_through = 0.0;
  double missing_m2 = 0.0;  ///< of what is seen through, the largest part that hangs together: a housing, a leg
};

/// How much of it a match may have and still be one. The defaults are for what was never calibrated.
struct MatchLimits {
  double least_fitness = 0.55;
  double most_beyond = 0.25;  ///< half of what the corner of something much larger carries on
  double most_seen_through = 0.06;
  double most_missing_m2 = 4.0 * kMet_m * kMet_m;  ///< smaller parts may be met by what stands around them
  bool Allow(const MatchEvidence& evidence) const {
    return evidence.fitness >= least_fitness && !Contradicted(evidence);
  }
  bool Contradicted(const MatchEvidence& evidence) const {
    return evidence.beyond > most_beyond || evidence.seen_through > most_seen_through ||
           evidence.missing_m2 > most_missing_m2;
  }
};

/// Limits for one target and camera, from what true matches of it show and what known negatives do: each in the
/// (geometric) middle between the worst match and the weakest of the negatives that show clearly more, but no wider
/// than the default. A negative that shows no more than matches do moves nothing: no camera tells it.
MatchLimits LimitsFrom(const std::vector<MatchEvidence>& matches, const std::vector<MatchEvidence>& negatives);

}  // namespace feeler::perception
