#include "feeler/env/vision/depth_noise.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "feeler/core/error.h"

namespace feeler::env {
namespace {

/// The neighbour that differs most in depth, if it differs by the jump; else 0.
float OtherSurface(const DepthImage& depth, int row, int column, double jump_m) {
  const float here = depth.at(row, column);
  float other = 0.0F;
  for (const auto& [down, right] : {std::pair{-1, 0}, std::pair{1, 0}, std::pair{0, -1}, std::pair{0, 1}}) {
    const int r = row + down;
    const int c = column + right;
    if (r < 0 || c < 0 || r >= depth.height || c >= depth.width) continue;
    const float there = depth.at(r, c);
    if (there <= 0.0F || std::abs(there - here) < jump_m) continue;
    if (other == 0.0F || std::abs(there - here) > std::abs(other - here)) other = there;
  }
  return other;
}

double Systematic(const DepthNoiseOptions& options, const Installation& installation, double distance_m) {
  if (!options.bias) return 0.0;
  const double phase = 2.0 * std::numbers::pi * distance_m / options.wiggle_period_m;
  return options.bias_m + options.bias_slope * distance_m + options.wiggle_m * std::sin(phase) + installation.bias_m;
}

}  // namespace

DepthNoiseOptions DepthNoiseOptions::Exact() {
  DepthNoiseOptions options;
  options.range = options.albedo = options.incidence = options.flying_pixels = false;
  options.dropout = options.quantisation = options.bias = options.extrinsics = false;
  return options;
}

void DepthNoiseOptions::Validate() const {
  const std::pair<const char*, double> fields[] = {{"near_sigma_m", near_sigma_m},
                                                   {"sigma_growth_per_m", sigma_growth_per_m},
                                                   {"largest_sigma_m", largest_sigma_m},
                                                   {"reference_albedo", reference_albedo},
                                                   {"flying_jump_m", flying_jump_m},
                                                   {"flying_probability", flying_probability},
                                                   {"dropout_probability", dropout_probability},
                                                   {"weakest_signal", weakest_signal},
                                                   {"quantum_m", quantum_m},
                                                   {"wiggle_m", wiggle_m},
                                                   {"wiggle_period_m", wiggle_period_m},
                                                   {"installation_bias_m", installation_bias_m},
                                                   {"extrinsic_position_m", extrinsic_position_m},
                                                   {"extrinsic_angle_rad", extrinsic_angle_rad}};
  for (const auto& [field, value] : fields) {
    if (!(value >= 0.0) || !std::isfinite(value)) {
      throw InputError("depth noise", fmt::format("{} is {}", field, value), "give a finite number, zero or more");
    }
  }
  if (!std::isfinite(bias_m) || !std::isfinite(bias_slope))
    throw InputError("depth noise", "the bias is not finite", "give a finite number");
  if (quantisation && quantum_m <= 0.0) throw InputError("depth noise", "quantum_m is 0", "switch quantisation off");
  if (bias && wiggle_period_m <= 0.0) throw InputError("depth noise", "wiggle_period_m is 0", "give a period above 0");
}

Installation DrawInstallation(const DepthNoiseOptions& options, RandomStream& random) {
  options.Validate();
  // All numbers are drawn whatever is switched on, so that a switch changes its own term only.
  Eigen::Vector3d position;
  Eigen::Vector3d axis;
  for (double& value : position) value = random.Uniform(-1.0, 1.0);
  for (double& value : axis) value = random.Normal();
  const double angle = random.Uniform(0.0, 1.0);
  const double bias = random.Uniform(-1.0, 1.0);
  Installation installation;
  if (options.extrinsics) {
    installation.believed_T_true.translation() = options.extrinsic_position_m * position;
    installation.believed_T_true.linear() =
        Eigen::AngleAxisd(options.extrinsic_angle_rad * angle, axis.normalized()).toRotationMatrix();
  }
  if (options.bias) installation.bias_m = options.installation_bias_m * bias;
  return installation;
}

DepthImage AddDepthNoise(const DepthView& view, const DepthNoiseOptions& options, const Installation& installation,
                         int frames, RandomStream& random) {
  options.Validate();
  if (frames < 1) throw InputError("depth noise", fmt::format("{} frames", frames), "average one or more");
  DepthImage result{view.depth.width, view.depth.height, std::vector<float>(view.depth.depth_m.size(), 0.0F)};
  for (int row = 0; row < view.depth.height; ++row) {
    for (int column = 0; column < view.depth.width; ++column) {
      const auto pixel =
          static_cast<std::size_t>(row) * static_cast<std::size_t>(view.depth.width) + static_cast<std::size_t>(column);
      double depth = view.depth.depth_m[pixel];
      if (depth <= 0.0) continue;
      if (options.flying_pixels) {
        const double other = OtherSurface(view.depth, row, column, options.flying_jump_m);
        if (other > 0.0 && random.Uniform() < options.flying_probability) depth += random.Uniform() * (other - depth);
      }
      const double stretch = view.ray_length[pixel];
      const double distance = depth * stretch;
      const double albedo = std::max(1e-3, static_cast<double>(view.albedo[pixel]));
      const double cosine = std::max(1e-3, static_cast<double>(view.cosine[pixel]));
      if (options.dropout && albedo * cosine < options.weakest_signal * distance * distance) continue;
      double sigma = options.range ? options.near_sigma_m + options.sigma_growth_per_m * distance * distance : 0.0;
      if (options.albedo) sigma *= std::sqrt(options.reference_albedo / albedo);
      if (options.incidence) sigma /= std::sqrt(cosine);
      sigma = std::min(sigma, options.largest_sigma_m);
      const double mean = distance + Systematic(options, installation, distance);
      double sum = 0.0;
      int readings = 0;
      for (int frame = 0; frame < frames; ++frame) {
        if (options.dropout && random.Uniform() < options.dropout_probability) continue;
        double reading = (sigma > 0.0 ? mean + sigma * random.Normal() : mean) / stretch;
        if (options.quantisation) reading = options.quantum_m * std::round(reading / options.quantum_m);
        sum += reading;
        ++readings;
      }
      if (2 * readings >= frames) result.depth_m[pixel] = static_cast<float>(sum / readings);
    }
  }
  return result;
}

}  // namespace feeler::env
