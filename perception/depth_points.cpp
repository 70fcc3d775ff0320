// What a depth image means, apart from the files it comes in: these need OpenCV, this does not.
#include <cmath>
#include <cstddef>

#include "feeler/core/error.h"
#include "feeler/perception/depth_file.h"
#include "feeler/perception/input_file.h"

namespace feeler::perception {
namespace {

constexpr int kLargestSide = 8192;

}  // namespace

CameraIntrinsics ParseIntrinsics(std::string_view json, const std::string& where) {
  const nlohmann::json root = ParseJson(json, where);
  CameraIntrinsics camera;
  camera.width = IntegerAt(root, "width", 2, kLargestSide, where);
  camera.height = IntegerAt(root, "height", 2, kLargestSide, where);
  camera.fx = NumberAt(root, "fx", 1.0, 1e6, where);
  camera.fy = NumberAt(root, "fy", 1.0, 1e6, where);
  camera.cx = NumberAt(root, "cx", -1e6, 1e6, where);
  camera.cy = NumberAt(root, "cy", -1e6, 1e6, where);
  if (root.contains("depth_scale_m")) camera.depth_scale_m = NumberAt(root, "depth_scale_m", 1e-6, 1.0, where);
  if (root.contains("world_T_camera")) camera.world_T_camera = PoseAt(root, "world_T_camera", where);
  return camera;
}

std::string ToJson(const CameraIntrinsics& camera) {
  nlohmann::ordered_json json = {{"width", camera.width},
                                 {"height", camera.height},
                                 {"fx", camera.fx},
                                 {"fy", camera.fy},
                                 {"cx", camera.cx},
                                 {"cy", camera.cy},
                                 {"depth_scale_m", camera.depth_scale_m}};
  json["world_T_camera"] = PoseJson(camera.world_T_camera);
  return json.dump(2) + "\n";
}

Points ToPoints(const DepthFrame& frame, const CameraIntrinsics& camera, const CloudOptions& options,
                const DepthFrame* background) {
  const auto same_size = [&](const DepthFrame& f) {
    return f.width == camera.width && f.height == camera.height &&
           f.depth_m.size() == static_cast<std::size_t>(f.width) * static_cast<std::size_t>(f.height);
  };
  if (!same_size(frame) || (background != nullptr && !same_size(*background))) {
    throw InputError("depth image", "its size is not that of the camera", "give the intrinsics of this image");
  }
  const auto width = static_cast<std::size_t>(frame.width);
  Points points;
  for (int row = 1; row + 1 < frame.height; ++row) {
    for (int column = 1; column + 1 < frame.width; ++column) {
      const std::size_t at = static_cast<std::size_t>(row) * width + static_cast<std::size_t>(column);
      const double depth = frame.depth_m[at];
      if (!(depth > 0.0) || !std::isfinite(depth)) continue;
      if (background != nullptr) {
        const double behind = background->depth_m[at];
        if (behind > 0.0 && depth > behind - options.background_margin_m) continue;
      }
      int neighbours = 0;
      for (const std::size_t other :
           {at - width - 1, at - width, at - width + 1, at - 1, at + 1, at + width - 1, at + width, at + width + 1}) {
        neighbours += std::abs(frame.depth_m[other] - depth) < options.same_surface_m ? 1 : 0;
      }
      if (neighbours < options.least_neighbours) continue;
      points.push_back(camera.world_T_camera * Eigen::Vector3d((column - camera.cx) / camera.fx * depth,
                                                               (row - camera.cy) / camera.fy * depth, depth));
    }
  }
  return points;
}

}  // namespace feeler::perception
