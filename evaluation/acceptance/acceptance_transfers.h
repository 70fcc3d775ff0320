#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "feeler/env/scene/scene.h"
#include "feeler/evaluation/harness/experiment.h"

namespace feeler::evaluation {

inline constexpr const char* kAcceptanceTransfersName = "acceptance-transfers";

/// Transfers between random poses in one scene: planned, then carried out in physics.
struct TransferTrials {
  std::string scene;
  int drawn = 0;   ///< poses drawn to find the goals
  int tried = 0;   ///< goals at which the robot can stand: some configuration is within limits and free
  int solved = 0;  ///< of those, a motion was planned
  std::map<std::string, int> unsolved;       ///< reason -> count
  int reached = 0;                           ///< of those, the robot arrived
  int touched = 0;                           ///< motions during which any contact was seen, at any time step
  std::vector<double> planning_cpu_s;        ///< per try: inverse kinematics, search, simplification
  std::vector<double> checks;                ///< per try: configurations checked
  std::vector<double> way_points;            ///< per plan
  std::vector<double> duration_s;            ///< per motion
  double tracking_error_m = 0.0;             ///< of the tool frame, largest at any time step
  double joint_speed_fraction = 0.0;         ///< largest measured joint speed by what the motion may use
  double joint_acceleration_fraction = 0.0;  ///< the same of the commanded acceleration
};

/// `count` transfers in a row, each from where the last one ended to a random pose at which the robot can stand (tool
/// down but for 20 degrees, any yaw, over the whole table); the first begins at home. Planned with a clearance of 4 mm.
TransferTrials TryTransfers(const env::Scene& scene, const std::string& name, int count, std::uint64_t seed);

ExperimentResult RunAcceptanceTransfers(const ExperimentRequest& request);

}  // namespace feeler::evaluation
