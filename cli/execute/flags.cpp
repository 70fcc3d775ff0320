#include "feeler/cli/execute/flags.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "feeler/cli/common/numbers.h"
#include "feeler/core/error.h"

namespace feeler::cli {
namespace {

std::vector<double> NumbersIn(const std::string& option, const std::string& text, std::size_t count,
                              const std::string& mend) {
  constexpr double kMost = 1e4;
  std::vector<double> numbers;
  for (std::size_t from = 0; from <= text.size();) {
    const std::size_t comma = std::min(text.find(',', from), text.size());
    numbers.push_back(ParseReal(option, text.substr(from, comma - from), -kMost, kMost));
    from = comma + 1;
  }
  if (numbers.size() != count) {
    throw InputError(option, fmt::format("has {} numbers, {} are needed", numbers.size(), count), mend);
  }
  return numbers;
}

}  // namespace

void AddExecuteFlags(CLI::App& app, ExecuteFlags& flags) {
  app.add_option("--db", flags.db, "policy database of the task, its bundle beside it (feeler preprocess)")->required();
  app.add_option("--robot", flags.robot,
                 "HOST:PORT of the robot, or listen:HOST:PORT where the robot's program dials in")
      ->required();
  app.add_option("--wire", flags.wire, "json, or numbers: what a robot controller's script speaks")
      ->check(CLI::IsMember({"json", "numbers"}))
      ->capture_default_str();
  app.add_option("--task", flags.task, "the task that the database must be of (default: what the bundle says)");
  app.add_option("--extents", flags.extents, "hypotheses per axis, e.g. 7x7x7 (default: what a simulation says)");
  app.add_option("--estimate", flags.estimate,
                 "where the target is believed to stand, in the base frame of the robot: x,y,z,qw,qx,qy,qz (m)");
  AddInteger(app, "--episodes", flags.episodes, 1, 10'000'000,
             "how many (default: all that a simulation offers, one on a robot)", false);
  app.add_option("--cell", flags.cell, "cell file (feeler cell calibrate): workspace box, sensor, tool, forces");
  app.add_option("--box", flags.box, "the tool stays within: x0,y0,z0,x1,y1,z1, base frame, m");
  app.add_option("--arm", flags.arm,
                 "URDF of the arm: ways are checked for reach, joint limits and singularities before they are sent "
                 "(default: what the robot says it is, if Feeler has it)");
  app.add_option("--arm-base", flags.arm_base, "link of it whose frame the robot tells poses in (default: its root)");
  AddReal(app, "--speed", flags.speed, 0.01, 1.0, "all Cartesian speeds times this");
  AddReal(
      app, "--force-budget", flags.force_budget_n, 1.0, 1000.0,
      "no contact harder than this, N: sets the speeds (default: the simulation's, else the task's, or more where the "
      "sensor's noise asks for it)",
      false);
  AddReal(app, "--confirm-limit", flags.confirm_limit_m, 1e-6, 1.0,
          "touch until the position across the insertion is known this well, m, default: 0.0005", false);
  app.add_flag("--no-ladder", flags.no_ladder, "the bare policy with its executor, without fallbacks");
  app.add_flag("--dry-run", flags.dry_run, "print the motions, as if the target stood at its estimate; move nothing");
  app.add_flag("--step", flags.step, "ask before each motion");
  app.add_flag("--start", flags.start, "the operator stands by and has said start: do not ask");
  app.add_option("--recover", flags.recover, "after a protective stop: ask, or never")
      ->check(CLI::IsMember({"ask", "never"}))
      ->capture_default_str();
  AddReal(app, "--heartbeat", flags.heartbeat_s, 0.001, 1.0, "s between heartbeats to the robot");
  AddReal(app, "--link-timeout", flags.link_timeout_s, 0.02, 60.0,
          "a robot that may be silent for longer is refused, s (simulations say themselves)");
  app.add_option("--token-file", flags.token_file, "file with the token that the robot asks for");
  app.add_option("--out", flags.out, "records, one JSON object a line (docs/file-formats.md)");
  app.add_flag("--live", flags.live, "tell of every motion on standard error (the default on a terminal)");
  app.add_flag("--json", flags.json, "print the summary as JSON");
}

Pose ParseEstimate(const std::string& text) {
  const std::vector<double> n = NumbersIn("--estimate", text, 7, "give x,y,z,qw,qx,qy,qz");
  const Eigen::Quaterniond q(n[3], n[4], n[5], n[6]);
  constexpr double kRounding = 0.01;
  if (std::abs(q.norm() - 1.0) > kRounding) {
    throw InputError("--estimate", fmt::format("the quaternion has length {:.3f}", q.norm()),
                     "give a unit quaternion, w first");
  }
  return MakePose(Eigen::Vector3d(n[0], n[1], n[2]), q);
}

execution::WorkspaceBox ParseBox(const std::string& option, const std::string& text) {
  const std::vector<double> n = NumbersIn(option, text, 6, "give x0,y0,z0,x1,y1,z1");
  const Eigen::Vector3d a(n[0], n[1], n[2]);
  const Eigen::Vector3d b(n[3], n[4], n[5]);
  const execution::WorkspaceBox box{a.cwiseMin(b), a.cwiseMax(b)};
  if (!((box.max_m - box.min_m).array() > 0.0).all()) throw InputError(option, "has no room", "give two corners");
  return box;
}

}  // namespace feeler::cli
