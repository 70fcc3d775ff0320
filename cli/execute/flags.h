#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>

#include "feeler/core/pose.h"
#include "feeler/execution/remote/checked_robot.h"

namespace feeler::cli {

struct ExecuteFlags {
  std::string db;
  std::string robot;
  std::string wire = "json";
  std::string task;
  std::string extents;
  std::string estimate;
  std::string box;
  std::string arm;
  std::string arm_base;
  std::string cell;
  std::string token_file;
  std::string out;
  std::string recover = "ask";
  std::int64_t episodes = 0;  ///< 0: all that a simulation offers; one on a robot
  double speed = 1.0;
  double confirm_limit_m = 0.0;  ///< 0: the executor's
  double force_budget_n = 0.0;   ///< 0: the executor's
  double heartbeat_s = 0.02;
  double link_timeout_s = 0.1;
  bool no_ladder = false;
  bool dry_run = false;
  bool step = false;
  bool start = false;
  bool live = false;
  bool json = false;
};

void AddExecuteFlags(CLI::App& app, ExecuteFlags& flags);

/// "x,y,z,qw,qx,qy,qz": metres and a quaternion. Throws InputError.
Pose ParseEstimate(const std::string& text);
/// "x0,y0,z0,x1,y1,z1": two corners, m. Throws InputError.
execution::WorkspaceBox ParseBox(const std::string& option, const std::string& text);

}  // namespace feeler::cli
