#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "feeler/policies/policy.h"
#include "feeler/policies/visual/visual_servoing_features.h"
#include "feeler/policies/visual/visual_servoing_law.h"

namespace feeler::policies {

struct VisualServoingOptions {
  double gain_per_s = 4.0;             ///< lambda
  double frame_period_s = 1.0 / 30.0;  ///< between pictures
  double speed_limit_m_s = 0.1;        ///< of the camera
  double angular_speed_limit_rad_s = 0.5;
  ServoFreedom freedom = ServoFreedom::kTranslation;  ///< the orientation of the target is known to all policies
  double reached_m = 0.00015;                         ///< the goal is reached when the law wants less than this,
  int reached_frames = 3;                             ///< in so many pictures one after the other
  int lost_frames = 15;                               ///< without features one after the other: give up
  int frame_limit = 400;
  double farthest_m = 0.15;  ///< commanded displacement from the start; beyond it the features mislead

  /// Throws InputError naming the option that is out of range.
  void Validate() const;
};

/// Image-based visual servoing with a camera on the wrist: moves the tool until the features of the picture stand where
/// they stood in the picture of the goal, v = -lambda L^+ e (Chaumette and Hutchinson 2006), with the depths of the
/// goal in L. Then inserts, without touching first. The uncertainty of the problem is not looked at.
///
/// Ends always: with the insertion, or giving up with the reason (features lost, no convergence, led astray).
class VisualServoingPolicy : public Policy {
 public:
  /// `name`: in records. Throws InputError for bad options or a goal without features' depths.
  VisualServoingPolicy(std::string name, std::shared_ptr<const VisualGoal> goal,
                       std::unique_ptr<FeatureTracker> tracker, const VisualServoingOptions& options = {});

  std::string_view name() const override { return name_; }
  bool reads_hypotheses() const override { return false; }
  void Begin(const planner::Problem& problem) override;
  Decision Next(const Belief& belief) override;
  bool Observe(const Outcome& outcome) override;
  void See(const CameraView& view) override;

  /// Pictures looked at since Begin.
  int frames() const { return frames_; }

 private:
  std::string name_;
  std::shared_ptr<const VisualGoal> goal_;
  std::unique_ptr<FeatureTracker> tracker_;
  VisualServoingOptions options_;
  Decision next_;
  int frames_ = 0;
  int reached_ = 0;
  int lost_ = 0;
  Eigen::Vector3d commanded_m_ = Eigen::Vector3d::Zero();  ///< in axes of the camera at the start
  Eigen::Matrix3d start_R_camera_ = Eigen::Matrix3d::Identity();
};

}  // namespace feeler::policies
