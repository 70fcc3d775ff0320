#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "feeler/core/pose.h"
#include "feeler/perception/match_evidence.h"
#include "feeler/perception/nearest_points.h"
#include "feeler/perception/point_cloud.h"

namespace feeler::perception {

/// The surface of the target in its own frame, ready to be matched: fine and, for the first rough fits, coarse.
/// Immutable; share it freely.
class TargetModel {
 public:
  /// Throws InputError for fewer than 50 points, numbers that are not finite or lists of different lengths.
  explicit TargetModel(const SurfacePoints& surface);

  struct Level {
    double spacing_m = 0.0;
    SurfacePoints surface;
    NearestPoints tree;
  };
  const Level& coarse() const { return coarse_; }
  const Level& fine() const { return fine_; }
  /// Of the points' bounding sphere about `center_m()`.
  double radius_m() const { return radius_m_; }
  const Eigen::Vector3d& center_m() const { return center_m_; }

 private:
  Level fine_;
  Level coarse_;
  Eigen::Vector3d center_m_;
  double radius_m_;
};

struct RegistrationOptions {
  /// About which axes of the target frame it may be turned from its nominal orientation, unit vectors; all else of the
  /// orientation is known. The default: yaw of a port that opens upwards.
  std::vector<Eigen::Vector3d> rotation_axes = {Eigen::Vector3d::UnitZ()};
  double start_turn_rad = 0.17;  ///< fits start at zero and at this either way about the first of those axes
  /// Weight of what holds the model along its faces, where planes alone would let it slide: measured points beyond an
  /// edge of the model, and points of the model beyond an edge of what was measured. Point to plane has weight 1.
  double edge_weight = 0.5;
  double neighbourhood_m = 0.05;  ///< clusters are ranked by how many points the densest ball of this radius holds
  int clusters = 3;               ///< how many of them are tried
  double scene_spacing_m = 0.006;
  MatchLimits limits;     ///< beyond them, the target counts as not found
  int least_points = 60;  ///< of the thinned scene
  void Validate() const;  ///< throws InputError
};

struct Registration : MatchEvidence {
  bool found = false;
  std::string reason;  ///< why not
  Pose world_T_target = Pose::Identity();
  double rms_m = 0.0;  ///< distance of the explained points from the model's surface
  int points = 0;      ///< measured points used
  /// Of (x, y, z in axes of the target, m; turns about rotation_axes, rad), from the residuals, as if points erred
  /// independently: what the noise of single points explains, without bias and installation errors, which the table
  /// (perception/uncertainty_table.h) holds.
  Eigen::MatrixXd covariance;
};

/// Finds the target in a scene without background (world frame), seen from `eye_m`: clusters, densest first; each from
/// several starts, rough fits, the best of them refined; the best fit wins. A poor one: once more, from more starts.
/// What is turned by more than 25 degrees is not looked for.
///
/// Point-to-plane ICP (Chen and Medioni 1992) from scene to what the eye sees of the model, blended with a term along
/// the faces in both directions, by Gauss-Newton in position and the given turns; pairs beyond a shrinking gate are
/// left out. A pure function of its arguments, whatever the order of `scene`. Points that are not finite are ignored.
///
/// A match must explain what is seen: it is refused where the scene goes on beyond the edges of the model, or is seen
/// where the model would hide it. `measured`: all that the camera measured, background too, which tells where it sees
/// through; empty: `scene`.
Registration Register(const Points& scene, const TargetModel& model, const Eigen::Matrix3d& nominal_orientation,
                      const Eigen::Vector3d& eye_m, const RegistrationOptions& options = {},
                      const Points& measured = {});

}  // namespace feeler::perception
