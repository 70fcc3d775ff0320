#pragma once

#include <vector>

#include "feeler/core/pose.h"
#include "feeler/core/random.h"
#include "feeler/env/vision/image.h"

namespace feeler::env {

/// How a time-of-flight depth camera differs from an exact one. Each term has a switch. The magnitudes keep within the
/// limits that Microsoft's hardware specification gives for the Azure Kinect DK (narrow field of view, unbinned):
/// random error at most 17 mm, systematic error below 11 mm + 0.1 % of the distance.
///
/// Where the terms come from: range, albedo and incidence from the shot noise of a demodulating pixel, sigma ~ 1 / sqrt
/// (returned light) (Lange and Seitz, Solid-state time-of-flight range camera, IEEE J. Quantum Electronics 37, 2001);
/// wiggling, flying pixels and the loss of dark pixels from Foix, Alenya and Torras, Lock-in time-of-flight cameras: a
/// survey (IEEE Sensors J. 11, 2011); the size of the random error at 0.5 to 3 m from Toelgyessy et al., Evaluation of
/// the Azure Kinect (Sensors 21, 2021).
struct DepthNoiseOptions {
  /// Random error along the ray: sigma = near + growth * distance^2, for a surface of the reference albedo met
  /// squarely.
  bool range = true;
  double near_sigma_m = 0.0006;
  double sigma_growth_per_m = 0.0009;
  double largest_sigma_m = 0.017;

  /// Darker surfaces return less: sigma times sqrt(reference / albedo).
  bool albedo = true;
  double reference_albedo = 0.5;
  /// So do slanted ones: sigma divided by sqrt(cosine of the angle of incidence).
  bool incidence = true;

  /// A pixel whose cone meets two surfaces at least `flying_jump_m` apart reads something in between, with this
  /// probability. The mixture belongs to the view: all frames of a capture share it.
  bool flying_pixels = true;
  double flying_jump_m = 0.02;
  double flying_probability = 0.5;

  /// No reading, at random, and wherever albedo * cosine / distance^2 is below `weakest_signal`.
  bool dropout = true;
  double dropout_probability = 0.01;
  double weakest_signal = 0.004;

  /// The camera delivers whole steps.
  bool quantisation = true;
  double quantum_m = 0.001;

  /// Systematic error along the ray: offset + slope * distance + wiggle, the same for every camera of the kind, and an
  /// offset per installation, uniform in +-`installation_bias_m`.
  bool bias = true;
  double bias_m = 0.001;
  double bias_slope = 0.001;
  double wiggle_m = 0.001;
  double wiggle_period_m = 0.375;
  double installation_bias_m = 0.001;

  /// The camera stands elsewhere than its user believes: drawn once per installation, uniform per axis and in the
  /// angle, about a random axis.
  bool extrinsics = true;
  double extrinsic_position_m = 0.002;
  double extrinsic_angle_rad = 0.00244;  ///< 0.14 degrees

  /// All terms off.
  static DepthNoiseOptions Exact();
  /// Throws InputError naming the field that is negative or not finite.
  void Validate() const;
};

/// What stays the same while a camera stays where it was mounted.
struct Installation {
  Pose believed_T_true = Pose::Identity();  ///< the true camera frame in the frame where the user believes it
  double bias_m = 0.0;
};

Installation DrawInstallation(const DepthNoiseOptions& options, RandomStream& random);

/// What the noise of a pixel depends on, images rows from the top, all of the size of `depth`.
struct DepthView {
  DepthImage depth;               ///< exact; 0: nothing there
  std::vector<float> ray_length;  ///< distance along the ray per metre along the optical axis
  std::vector<float> albedo;      ///< in the near infrared
  std::vector<float> cosine;      ///< of the angle of incidence
};

/// The mean of `frames` noisy frames of a view, pixel by pixel over those that have a reading; 0 where fewer than half
/// of them do. Draws from `random` in an order that depends on the view and the options only.
/// Throws InputError if `frames` is not positive or the options make no sense.
DepthImage AddDepthNoise(const DepthView& view, const DepthNoiseOptions& options, const Installation& installation,
                         int frames, RandomStream& random);

}  // namespace feeler::env
