#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>
#include <string>

#include "feeler/perception/uncertainty_table.h"
#include "feeler/workflow/perception/perceive.h"

namespace feeler::cli {

/// What a camera saw, as files.
struct TargetSources {
  std::string depth, intrinsics, background;
  std::string cloud;
  std::string table;
  bool any() const { return !depth.empty() || !cloud.empty(); }
};
void AddTargetSources(CLI::App& command, TargetSources& sources);

/// Throws InputError for sources that do not go together.
void RequireSources(const std::string& task, const TargetSources& sources);
/// Looks for the target in them; `expected_m`: where the task has it. Where it is not found in a depth image that may
/// be in another unit, the reason says so. Throws InputError for files that cannot be read.
perception::Registration Locate(const TargetSources& sources, const workflow::TargetFinder& finder,
                                const perception::UncertaintyTable& table, const Eigen::Vector3d& expected_m);

/// As options of feeler execute.
struct PerceivedTarget {
  std::string estimate;  ///< x,y,z,qw,qx,qy,qz
  std::string extents;
  std::int64_t hypotheses = 0;
};
/// The estimate, and the smallest problem of the database (if one is given) that covers it. Throws InputError, or
/// NegativeResult where there is no target or no such problem.
PerceivedTarget FindTarget(const std::string& task, const std::string& db, const TargetSources& sources);

}  // namespace feeler::cli
