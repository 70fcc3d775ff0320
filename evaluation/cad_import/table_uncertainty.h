#pragma once

#include <Eigen/Core>
#include <string>

namespace feeler::evaluation {

/// Where a target may be, to each side, and where that is known from.
struct StatedUncertainty {
  Eigen::Vector3d half_m = Eigen::Vector3d::Zero();
  std::string source;  ///< a half sentence
  std::string note;    ///< what was left out; may be empty
};

/// What a calibrated camera leaves open: of all rules of an uncertainty table (`feeler perceive calibrate`, of whatever
/// task) the largest half extent along each axis of position, 0 along one that its task knows. Turns are left out, and
/// named. Throws InputError for what is no table.
StatedUncertainty UncertaintyOfTable(const std::string& path);

}  // namespace feeler::evaluation
