// SIFT features matched to those of a goal picture.
#include <fmt/format.h>

#include <Eigen/LU>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/core/random.h"
#include "feeler/policies/visual/visual_servoing_features.h"

namespace feeler::policies {
namespace {

using AffineMap = Eigen::Matrix<double, 2, 3>;  // goal (x, y, 1) to seen

Eigen::Vector3d Homogeneous(const Eigen::Vector2d& p) { return {p.x(), p.y(), 1.0}; }

std::vector<std::size_t> Agreeing(const std::vector<FeatureMatch>& matches, const AffineMap& map, double inlier_px) {
  std::vector<std::size_t> agreeing;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if ((map * Homogeneous(matches[i].goal_px) - matches[i].seen_px).norm() <= inlier_px) agreeing.push_back(i);
  }
  return agreeing;
}

/// The matches that the largest group found agrees on (Fischler and Bolles 1981).
std::vector<FeatureMatch> Consensus(const std::vector<FeatureMatch>& matches, double inlier_px) {
  constexpr int kSamples = 300;
  constexpr double kSmallest_px2 = 300.0;  // area of the triangle of a sample: smaller ones tell no affine map
  std::vector<std::size_t> best;
  if (matches.size() < 3) return {};
  RandomStream random(1, matches.size(), "sift consensus");
  for (int sample = 0; sample < kSamples; ++sample) {
    Eigen::Matrix3d goal;
    Eigen::Matrix<double, 2, 3> seen;
    for (int i = 0; i < 3; ++i) {
      const FeatureMatch& match = matches[random.Index(matches.size())];
      goal.col(i) = Homogeneous(match.goal_px);
      seen.col(i) = match.seen_px;
    }
    if (std::abs(goal.determinant()) < 2.0 * kSmallest_px2) continue;
    std::vector<std::size_t> agreeing = Agreeing(matches, seen * goal.inverse(), inlier_px);
    if (agreeing.size() > best.size()) best = std::move(agreeing);
  }
  std::vector<FeatureMatch> result;
  result.reserve(best.size());
  for (const std::size_t i : best) result.push_back(matches[i]);
  return result;
}

class SiftTracker : public FeatureTracker {
 public:
  SiftTracker(std::shared_ptr<const VisualGoal> goal, const SiftOptions& options)
      : goal_(std::move(goal)),
        options_(options),
        sift_(cv::SIFT::create(options.features, 3, options.contrast_threshold)) {
    const CameraView& view = goal_->view;
    cv::Mat hidden(view.height, view.width, CV_8U, cv::Scalar(0));
    std::copy(goal_->hidden.begin(), goal_->hidden.end(), hidden.begin<std::uint8_t>());
    const int side = 2 * options.hidden_margin_px + 1;
    cv::dilate(hidden, hidden, cv::getStructuringElement(cv::MORPH_RECT, {side, side}));
    seen_mask_ = hidden == 0;
    Detect(view, goal_points_, goal_descriptors_);
  }

  std::string_view name() const override { return "sift"; }
  int goal_features() const override { return static_cast<int>(goal_points_.size()); }

  FeatureMatches Match(const CameraView& view) override {
    std::vector<cv::KeyPoint> points;
    cv::Mat descriptors;
    if (view.width == goal_->view.width && view.height == goal_->view.height) Detect(view, points, descriptors);
    std::vector<FeatureMatch> matches;
    if (points.size() >= 2 && goal_points_.size() >= 2) {
      std::vector<std::vector<cv::DMatch>> nearest;
      cv::BFMatcher(cv::NORM_L2).knnMatch(descriptors, goal_descriptors_, nearest, 2);
      for (const auto& two : nearest) {
        if (two.size() < 2 || two[0].distance > options_.ratio * static_cast<double>(two[1].distance)) continue;
        const cv::Point2f& seen = points[static_cast<std::size_t>(two[0].queryIdx)].pt;
        const cv::Point2f& goal = goal_points_[static_cast<std::size_t>(two[0].trainIdx)].pt;
        const float depth =
            goal_->depth_m[static_cast<std::size_t>(std::lround(goal.y)) * static_cast<std::size_t>(goal_->view.width) +
                           static_cast<std::size_t>(std::lround(goal.x))];
        if (depth > 0.0F) matches.push_back({{seen.x, seen.y}, {goal.x, goal.y}, depth});
      }
    }
    FeatureMatches result;
    result.matches = Consensus(matches, options_.inlier_px);
    if (static_cast<int>(result.matches.size()) < options_.least_matches) {
      result.lost = fmt::format("{} SIFT features in the picture and {} in the goal's, {} of {} matches agree",
                                points.size(), goal_points_.size(), result.matches.size(), matches.size());
      result.matches.clear();
    }
    return result;
  }

 private:
  void Detect(const CameraView& view, std::vector<cv::KeyPoint>& points, cv::Mat& descriptors) const {
    const cv::Mat rgb(view.height, view.width, CV_8UC3, const_cast<std::uint8_t*>(view.rgb.data()));  // only read
    cv::Mat grey;
    cv::cvtColor(rgb, grey, cv::COLOR_RGB2GRAY);
    sift_->detectAndCompute(grey, seen_mask_, points, descriptors);
  }

  std::shared_ptr<const VisualGoal> goal_;
  SiftOptions options_;
  cv::Ptr<cv::SIFT> sift_;
  cv::Mat seen_mask_;
  std::vector<cv::KeyPoint> goal_points_;
  cv::Mat goal_descriptors_;
};

}  // namespace

std::unique_ptr<FeatureTracker> MakeSiftTracker(std::shared_ptr<const VisualGoal> goal, const SiftOptions& options) {
  const auto pixels = static_cast<std::size_t>(goal->view.width) * static_cast<std::size_t>(goal->view.height);
  if (pixels == 0 || goal->view.rgb.size() != 3 * pixels || goal->depth_m.size() != pixels ||
      goal->hidden.size() != pixels) {
    throw InputError("visual goal", "no picture, or depth or mask of another size", "teach it anew");
  }
  return std::make_unique<SiftTracker>(std::move(goal), options);
}

}  // namespace feeler::policies
