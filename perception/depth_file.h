#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "feeler/core/pose.h"
#include "feeler/perception/point_cloud.h"

namespace feeler::perception {

/// A depth camera: pinhole, u = fx x / z + cx, v = fy y / z + cy with x to the right, y down, z forward, and where it
/// stands.
struct CameraIntrinsics {
  int width = 0;
  int height = 0;
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;
  double depth_scale_m = 0.001;            ///< metres per unit of a 16-bit depth image
  Pose world_T_camera = Pose::Identity();  ///< in the base frame of the robot
};

/// Metres along the optical axis, rows from the top; 0: no reading.
struct DepthFrame {
  int width = 0;
  int height = 0;
  std::vector<float> depth_m;
};

/// Reads the JSON of a camera (docs/file-formats.md). `where` stands for the file in messages. Throws InputError.
CameraIntrinsics ParseIntrinsics(std::string_view json, const std::string& where);
std::string ToJson(const CameraIntrinsics& camera);

/// Where a picture may be in another unit than its intrinsics say: at the pixels around `expected_m` (world), where
/// something is expected, it sees much farther or nearer than that. Names the units in use by cameras and data sets
/// that would fit (millimetres, 0.25 mm, TUM's 5000 per metre, ...), as the end of a sentence; empty where the unit
/// may be right.
std::string GuessDepthUnit(const DepthFrame& frame, const CameraIntrinsics& camera, const Eigen::Vector3d& expected_m);

/// Decodes a 16-bit grey PNG; a pixel is a depth in units of `camera.depth_scale_m`, 0: no reading.
/// Throws InputError for what is not such an image, is damaged, or has another size than the camera; and for depths
/// that no depth camera gives (all below 2 cm or above 50 m), the sign of a wrong scale.
DepthFrame ParseDepthPng(std::string_view bytes, const CameraIntrinsics& camera, const std::string& where);
/// The same as bytes of a PNG. Depths beyond what 16 bits hold become 0.
std::string EncodeDepthPng(const DepthFrame& frame, double depth_scale_m);

/// What is kept when a depth image becomes points.
struct CloudOptions {
  /// A pixel is kept if so many of its eight neighbours lie within `same_surface_m` of it along the axis: flying pixels
  /// at edges have fewer.
  int least_neighbours = 5;
  double same_surface_m = 0.02;
  /// With a picture of the scene without the target: a pixel is kept if it is nearer than there by more than this.
  double background_margin_m = 0.012;
};

/// The points of a depth image in the world. `background`: the same camera's picture without the target, or null.
/// Throws InputError if sizes differ.
Points ToPoints(const DepthFrame& frame, const CameraIntrinsics& camera, const CloudOptions& options = {},
                const DepthFrame* background = nullptr);

}  // namespace feeler::perception
