#pragma once

#include <string>
#include <vector>

#include "feeler/perception/depth_file.h"
#include "feeler/perception/point_cloud.h"

namespace feeler::perception {

/// A few points, one of them not a number where the format can say so.
Points SamplePoints();

std::string AsciiPly(const Points& points);
/// Doubles, a list element before the vertices, a property between x and y.
std::string BinaryPly(const Points& points, bool big_endian);
std::string AsciiPcd(const Points& points);
/// Floats, with a field of three counts between y and z.
std::string BinaryPcd(const Points& points);

CameraIntrinsics SampleCamera(int width, int height);

}  // namespace feeler::perception
