#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "codec.h"
#include "common.h"
#include "feeler/env/gym/insertion_env.h"

namespace feeler::python {

/// `info` of Gymnasium (docs/python-environment.md).
nb::dict InfoDict(const env::Info& info);

/// actions, control_steps, max_displacement_m, max_turn_rad, reward_progress.
CodecOptions CodecFrom(const nb::dict& options);
/// Options of an environment from keywords: reward_per_second, time_limit_s, width, height.
env::EnvOptions ToEnvOptions(const nb::dict& options, const env::Scene& scene);
/// Options of a reset from a dict: estimate, target, extents, hypotheses, noise, start, withhold_true_pose, randomize.
/// Throws InputError for a key that it does not know, naming those it does.
env::ResetOptions ToResetOptions(const nb::dict& options);

nb::object ToArray(const env::Image& image);
nb::object ToArray(const env::DepthImage& image);
env::Camera ToCamera(const std::string& name, const env::Scene& scene);

/// A scene of a task: compiled once, shared by environments.
std::shared_ptr<const env::Scene> MakeScene(const std::string& task);

}  // namespace feeler::python
