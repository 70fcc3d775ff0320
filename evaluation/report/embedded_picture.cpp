#include "feeler/evaluation/report/embedded_picture.h"

#include <cstdint>
#include <fstream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "feeler/core/captured_stderr.h"
#include "feeler/evaluation/records/replay_json.h"

namespace feeler::evaluation {

std::string PictureDataUrl(const std::string& path) {
  constexpr std::size_t kLargest = 400'000;
  constexpr int kWidest = 1280;
  const bool png = path.ends_with(".png");
  if (!png && !path.ends_with(".jpg") && !path.ends_with(".jpeg")) return "";
  std::ifstream in(path, std::ios::binary);
  if (!in) return "";
  std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(in), {}};
  cv::Mat image;
  try {
    const CapturedStderr captured;  // what the decoders think of a damaged picture: its caller says it is none
    image = cv::imdecode(bytes, cv::IMREAD_COLOR);
  } catch (const cv::Exception&) {
    return "";
  }
  if (image.empty()) return "";
  if (bytes.size() <= kLargest) return std::string("data:image/") + (png ? "png" : "jpeg") + ";base64," + Base64(bytes);
  cv::Mat smaller = image;
  if (image.cols > kWidest) {
    cv::resize(image, smaller, cv::Size(kWidest, image.rows * kWidest / image.cols), 0.0, 0.0, cv::INTER_AREA);
  }
  std::vector<std::uint8_t> jpeg;
  cv::imencode(".jpg", smaller, jpeg, {cv::IMWRITE_JPEG_QUALITY, 85});
  return "data:image/jpeg;base64," + Base64(jpeg);
}

}  // namespace feeler::evaluation
