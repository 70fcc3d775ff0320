// Corners of a red rectangle.
#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/policies/visual/visual_servoing_features.h"

namespace feeler::policies {
namespace {

/// Red above the larger of green and blue, not below zero.
cv::Mat Redness(const CameraView& view) {
  cv::Mat redness(view.height, view.width, CV_8U);
  const std::uint8_t* rgb = view.rgb.data();
  for (int row = 0; row < view.height; ++row) {
    std::uint8_t* out = redness.ptr<std::uint8_t>(row);
    for (int column = 0; column < view.width; ++column, rgb += 3) {
      out[column] = static_cast<std::uint8_t>(std::max(0, rgb[0] - std::max(rgb[1], rgb[2])));
    }
  }
  return redness;
}

double At(const cv::Mat& image, const Eigen::Vector2d& p) {
  const int column = static_cast<int>(std::floor(p.x()));
  const int row = static_cast<int>(std::floor(p.y()));
  if (column < 0 || row < 0 || column + 1 >= image.cols || row + 1 >= image.rows) return 0.0;
  const double a = p.x() - column;
  const double b = p.y() - row;
  const std::uint8_t* upper = image.ptr<std::uint8_t>(row);
  const std::uint8_t* lower = image.ptr<std::uint8_t>(row + 1);
  return (1 - b) * ((1 - a) * upper[column] + a * upper[column + 1]) +
         b * ((1 - a) * lower[column] + a * lower[column + 1]);
}

struct Line {
  Eigen::Vector2d point;
  Eigen::Vector2d direction;
};

/// The line where the redness falls to half, along the side from `begin` to `end`; `outward` is its normal.
std::optional<Line> FitEdge(const cv::Mat& redness, const Eigen::Vector2d& begin, const Eigen::Vector2d& end,
                            const Eigen::Vector2d& outward, double range_px) {
  constexpr double kStep_px = 0.25;
  constexpr double kMargin = 0.12;  // corners are rounded by the sampling
  const double length = (end - begin).norm();
  const int samples = std::clamp(static_cast<int>(length), 8, 200);
  std::vector<Eigen::Vector2d> edge;
  for (int i = 0; i < samples; ++i) {
    const double fraction = kMargin + (1.0 - 2.0 * kMargin) * i / (samples - 1);
    const Eigen::Vector2d base = begin + fraction * (end - begin);
    const double half = 0.5 * (At(redness, base - range_px * outward) + At(redness, base + range_px * outward));
    double before = At(redness, base - range_px * outward);
    for (double s = -range_px + kStep_px; s <= range_px; s += kStep_px) {
      const double now = At(redness, base + s * outward);
      if (before >= half && now < half) {
        edge.emplace_back(base + (s - kStep_px * (half - now) / (before - now)) * outward);
        break;
      }
      before = now;
    }
  }
  if (edge.size() < 5) return std::nullopt;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& p : edge) mean += p / static_cast<double>(edge.size());
  Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero();
  for (const Eigen::Vector2d& p : edge) scatter += (p - mean) * (p - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(scatter);
  return Line{mean, axes.eigenvectors().col(1)};
}

std::optional<Eigen::Vector2d> Crossing(const Line& a, const Line& b) {
  Eigen::Matrix2d system;
  system << a.direction, -b.direction;
  if (std::abs(system.determinant()) < 0.05) return std::nullopt;
  return a.point + a.direction * (system.inverse() * (b.point - a.point)).x();
}

/// The hull thinned out to four corners, clockwise in the picture from the upper left on; empty where it has not four.
std::vector<Eigen::Vector2d> FourCorners(const std::vector<cv::Point>& hull) {
  const double round = cv::arcLength(hull, true);
  std::vector<cv::Point> four;
  for (double tolerance = 0.01; tolerance < 0.12 && four.size() != 4; tolerance += 0.005) {
    cv::approxPolyDP(hull, four, tolerance * round, true);
  }
  if (four.size() != 4) return {};
  std::vector<Eigen::Vector2d> corners;
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const cv::Point& p : four) {
    corners.emplace_back(p.x, p.y);
    middle += 0.25 * corners.back();
  }
  const auto angle = [&](const Eigen::Vector2d& p) { return std::atan2(p.y() - middle.y(), p.x() - middle.x()); };
  std::sort(corners.begin(), corners.end(),
            [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return angle(a) < angle(b); });
  return corners;  // y points down: growing angles are clockwise, from the left side over the upper left corner
}

class TapeTracker : public FeatureTracker {
 public:
  TapeTracker(std::shared_ptr<const VisualGoal> goal, const TapeOptions& options)
      : goal_(std::move(goal)), options_(options), goal_corners_(FindTapeCorners(goal_->view, options).corners_px) {
    const auto width = static_cast<std::size_t>(goal_->view.width);
    // A corner itself lies on an edge: the depth a little inside is that of the tape.
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();
    for (const Eigen::Vector2d& corner : goal_corners_) middle += 0.25 * corner;
    for (const Eigen::Vector2d& corner : goal_corners_) {
      const Eigen::Vector2d inside = corner + 0.08 * (middle - corner);
      goal_depth_m_.push_back(goal_->depth_m[static_cast<std::size_t>(std::lround(inside.y())) * width +
                                             static_cast<std::size_t>(std::lround(inside.x()))]);
    }
  }

  std::string_view name() const override { return "tape"; }
  int goal_features() const override { return static_cast<int>(goal_corners_.size()); }

  FeatureMatches Match(const CameraView& view) override {
    if (goal_corners_.empty()) return {{}, "no tape in the picture of the goal"};
    const TapeCorners seen = FindTapeCorners(view, options_);
    if (seen.corners_px.empty()) return {{}, seen.lost};
    FeatureMatches result;
    for (std::size_t i = 0; i < seen.corners_px.size(); ++i) {
      result.matches.push_back({seen.corners_px[i], goal_corners_[i], goal_depth_m_[i]});
    }
    return result;
  }

 private:
  std::shared_ptr<const VisualGoal> goal_;
  TapeOptions options_;
  std::vector<Eigen::Vector2d> goal_corners_;
  std::vector<double> goal_depth_m_;
};

}  // namespace

TapeCorners FindTapeCorners(const CameraView& view, const TapeOptions& options) {
  const cv::Mat redness = Redness(view);
  const cv::Mat mask = redness >= options.least_redness;
  cv::Mat labels;
  cv::Mat stats;
  cv::Mat centres;
  const int patches = cv::connectedComponentsWithStats(mask, labels, stats, centres, 8);
  int tape = -1;
  for (int patch = 1; patch < patches; ++patch) {
    if (tape < 0 || stats.at<int>(patch, cv::CC_STAT_AREA) > stats.at<int>(tape, cv::CC_STAT_AREA)) tape = patch;
  }
  const int area = tape < 0 ? 0 : stats.at<int>(tape, cv::CC_STAT_AREA);
  if (area < options.least_area_px) return {{}, "no red tape in the picture"};
  const int left = stats.at<int>(tape, cv::CC_STAT_LEFT);
  const int top = stats.at<int>(tape, cv::CC_STAT_TOP);
  if (left <= 1 || top <= 1 || left + stats.at<int>(tape, cv::CC_STAT_WIDTH) >= view.width - 1 ||
      top + stats.at<int>(tape, cv::CC_STAT_HEIGHT) >= view.height - 1) {
    return {{}, "the red tape leaves the picture"};
  }
  std::vector<std::vector<cv::Point>> outlines;
  cv::findContours(labels == tape, outlines, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  if (outlines.empty()) return {{}, "no red tape in the picture"};
  std::vector<cv::Point> hull;
  cv::convexHull(outlines.front(), hull);
  if (area < options.least_fill * cv::contourArea(hull)) return {{}, "the red tape is partly hidden"};
  const std::vector<Eigen::Vector2d> rough = FourCorners(hull);
  if (rough.empty()) return {{}, "the red tape does not show four corners"};

  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& corner : rough) middle += 0.25 * corner;
  std::array<std::optional<Line>, 4> sides;
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d& begin = rough[i];
    const Eigen::Vector2d& end = rough[(i + 1) % 4];
    const Eigen::Vector2d along = (end - begin).normalized();
    Eigen::Vector2d outward(along.y(), -along.x());
    if (outward.dot(0.5 * (begin + end) - middle) < 0.0) outward = -outward;
    // Not so far inwards that the opposite side comes into it.
    const double depth = std::abs(outward.dot(0.5 * (begin + end) - middle));
    sides[i] = FitEdge(redness, begin, end, outward, std::min(options.edge_range_px, 0.8 * depth));
    if (!sides[i]) return {{}, "an edge of the red tape is not to be seen"};
  }
  TapeCorners result;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto corner = Crossing(*sides[(i + 3) % 4], *sides[i]);
    if (!corner || (*corner - rough[i]).norm() > 2.0 * options.edge_range_px) {
      return {{}, "the edges of the red tape do not meet at its corners"};
    }
    result.corners_px.push_back(*corner);
  }
  return result;
}

std::unique_ptr<FeatureTracker> MakeTapeTracker(std::shared_ptr<const VisualGoal> goal, const TapeOptions& options) {
  const auto pixels = static_cast<std::size_t>(goal->view.width) * static_cast<std::size_t>(goal->view.height);
  if (pixels == 0 || goal->view.rgb.size() != 3 * pixels || goal->depth_m.size() != pixels) {
    throw InputError("visual goal", "no picture, or depth of another size", "teach it anew");
  }
  return std::make_unique<TapeTracker>(std::move(goal), options);
}

}  // namespace feeler::policies
