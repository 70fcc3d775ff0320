#pragma once

#include <map>
#include <string>
#include <vector>

#include "feeler/env/scene/scene.h"
#include "feeler/workflow/assembly/assembly.h"

namespace feeler::workflow {

/// A part overlaps another; names as in BuildStage, "table" or "the robot".
struct PartOverlap {
  std::string first;
  std::string second;
  double depth_m = 0.0;
};

/// All overlaps between different things in a scene with the arm at `q_rad`, the tool left out, deepest first.
std::vector<PartOverlap> FindOverlaps(const env::Scene& scene, const env::JointVector& q_rad);

/// Compares, at places and turns drawn from the tool's workspace, whether the part of an insertion touches anything in
/// its stage with whether the tool touches the target in its task. Where both agree everywhere, the contact map, the
/// policies and the fit of the task hold for the insertion.
class MatingCheck {
 public:
  explicit MatingCheck(const Assembly& assembly) : assembly_(assembly) {}

  /// What differs, for people; empty if nothing does. `scene`: BuildStage of kInsert.
  std::string Difference(const env::Scene& scene, std::size_t insertion);

 private:
  const Assembly& assembly_;
  std::map<std::string, std::vector<double>> of_task_;  ///< depth at each place, by task; found once
};

}  // namespace feeler::workflow
