#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "feeler/core/pose.h"
#include "feeler/core/robot.h"

namespace feeler::policies {

/// What the camera saw when the tool was taught its goal, once.
struct VisualGoal {
  CameraView view;
  std::vector<float> depth_m;        ///< of each pixel, along the optical axis; 0: unknown
  std::vector<std::uint8_t> hidden;  ///< of each pixel, 1: the robot's own tool and gripper, always in the same place
  Pose tool_T_target = Pose::Identity();  ///< where the target is when the tool stands at the goal
};

/// One feature in the present picture and in that of the goal, in pixels.
struct FeatureMatch {
  Eigen::Vector2d seen_px = Eigen::Vector2d::Zero();
  Eigen::Vector2d goal_px = Eigen::Vector2d::Zero();
  double goal_depth_m = 0.0;
};

/// Features of a picture; none: `lost` says why.
struct FeatureMatches {
  std::vector<FeatureMatch> matches;
  std::string lost;
};

/// Finds the features of the goal again. One object per thread; a function of the picture alone.
class FeatureTracker {
 public:
  virtual ~FeatureTracker() = default;
  virtual std::string_view name() const = 0;
  virtual FeatureMatches Match(const CameraView& view) = 0;
  /// Features of the goal itself; none: the goal cannot be used.
  virtual int goal_features() const = 0;
};

struct TapeOptions {
  int least_redness = 50;      ///< red above the larger of green and blue, of 255
  int least_area_px = 150;     ///< a smaller patch is not the tape
  double least_fill = 0.92;    ///< of the patch in its hull: less, and something hides part of it
  double edge_range_px = 4.0;  ///< an edge is looked for this far to both sides
};

/// The corners of a red rectangle, found by a colour mask: where straight lines through its edges, located to a
/// fraction of a pixel, cross. In the order of the picture from the upper left on, clockwise: good for turns below
/// some 40 degrees. Empty, with the reason, where there is no whole rectangle in the picture.
struct TapeCorners {
  std::vector<Eigen::Vector2d> corners_px;
  std::string lost;
};
TapeCorners FindTapeCorners(const CameraView& view, const TapeOptions& options = {});

struct SiftOptions {
  int features = 500;                ///< the strongest so many
  double contrast_threshold = 0.04;  ///< Lowe's 0.03 in OpenCV's measure, its default
  double ratio = 0.8;                ///< nearest against second nearest descriptor (Lowe 2004)
  double inlier_px = 3.0;            ///< from the affine map that most matches agree on
  int least_matches = 8;             ///< that agree; fewer: lost
  int hidden_margin_px = 6;          ///< features so near to the robot's own outline are not used
};

/// Throws InputError if the goal holds no picture or one of another size than its depth.
std::unique_ptr<FeatureTracker> MakeTapeTracker(std::shared_ptr<const VisualGoal> goal,
                                                const TapeOptions& options = {});
/// Scale-invariant features (Lowe, Distinctive image features from scale-invariant keypoints, IJCV 60, 2004), matched
/// to those of the goal; matches that do not agree on one affine map are dropped (random sample consensus, same
/// picture, same result).
std::unique_ptr<FeatureTracker> MakeSiftTracker(std::shared_ptr<const VisualGoal> goal,
                                                const SiftOptions& options = {});

}  // namespace feeler::policies
