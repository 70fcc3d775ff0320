// feeler cell: what is known of a robot's cell.
#include <fmt/format.h>

#include <memory>
#include <string>

#include "feeler/cli/commands.h"
#include "feeler/cli/common/console.h"
#include "feeler/cli/common/numbers.h"
#include "feeler/cli/common/outputs.h"
#include "feeler/cli/execute/flags.h"
#include "feeler/cli/execute/operator.h"
#include "feeler/core/error.h"
#include "feeler/execution/remote/calibrate.h"
#include "feeler/execution/remote/remote_robot.h"
#include "feeler/execution/remote/token_file.h"

namespace feeler::cli {
namespace {

struct CellFlags {
  std::string robot;
  std::string block;
  std::string box;
  std::string tool;
  std::string token_file;
  std::string out;
  execution::CalibrationSettings settings;
  bool top_only = false;
  bool start = false;
  bool json = false;
};

void Calibrate(const CellFlags& flags, Session& session) {
  RequireOutputs({{"--out", flags.out, FileKind::kCell}}, {flags.token_file});
  const execution::WorkspaceBox corners = ParseBox("--block", flags.block);
  const execution::KnownBlock block{corners.min_m, corners.max_m};
  execution::RemoteOptions remote;
  remote.token = execution::ReadTokenFile(flags.token_file);
  remote.cancellation = session.cancellation;
  constexpr double kConnect_s = 10.0;
  execution::RemoteRobot robot(execution::Connect(execution::ParseAddress("--robot", flags.robot), kConnect_s), remote);
  execution::SafetyLimits limits;
  limits.robot = robot.welcome().capabilities;
  if (!flags.box.empty()) limits.box = ParseBox("--box", flags.box);
  if (!robot.welcome().simulated && !flags.start) {
    Operator person(session.cancellation);
    const std::string question =
        fmt::format("{} is about to touch the block. Is the cell clear, and the stop at hand? Press Enter to start: ",
                    robot.welcome().robot);
    if (!person.Agrees(question))
      throw NegativeResult("operator", "did not start the robot", "answer, or give --start");
  }
  robot.Start();
  execution::CheckedRobot checked(robot, limits);
  execution::CalibrationSettings settings = flags.settings;
  settings.sides = !flags.top_only;
  settings.tell = [](const std::string& what) { Note("feeler: {}\n", what); };
  execution::CellFile cell = execution::Calibrate(checked, block, settings);
  cell.tool = flags.tool;
  cell.robot = robot.welcome().robot;
  if (!flags.box.empty()) cell.box = limits.box;
  robot.Bye();
  execution::WriteCellFile(flags.out, cell);
  if (flags.json) {
    PrintJson({{"force_bias_n", *cell.force_bias_n},
               {"force_noise_n", *cell.force_noise_n},
               {"contact_force_n", *cell.contact_force_n},
               {"stiffness_n_m", *cell.stiffness_n_m},
               {"reaction_time_s", *cell.reaction_time_s},
               {"tool_offset_m", {cell.tool_offset_m.x(), cell.tool_offset_m.y(), cell.tool_offset_m.z()}}});
    return;
  }
  Print(
      "bias {:.2f} N, noise {:.2f} N, contacts from {:.1f} N on; stiffness {:.0f} N/m, reaction {:.1f} ms;\n"
      "tool centre point off by {:.2f} {:.2f} {:.2f} mm\n",
      *cell.force_bias_n, *cell.force_noise_n, *cell.contact_force_n, *cell.stiffness_n_m, 1e3 * *cell.reaction_time_s,
      1e3 * cell.tool_offset_m.x(), 1e3 * cell.tool_offset_m.y(), 1e3 * cell.tool_offset_m.z());
}

}  // namespace

void AddCellCommand(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand("cell", "What is known of a robot's cell");
  command->require_subcommand(1);
  auto flags = std::make_shared<CellFlags>();
  CLI::App* calibrate = command->add_subcommand(
      "calibrate", "Touch a known block: sensor bias, tool centre point, stiffness, reaction time");
  calibrate->add_option("--robot", flags->robot, "HOST:PORT of the robot (docs/robot-protocol.md)")->required();
  calibrate->add_option("--block", flags->block, "the block, in the base frame: x0,y0,z0,x1,y1,z1 (m)")->required();
  calibrate->add_option("--out", flags->out, "cell file, which feeler execute --cell reads")->required();
  calibrate->add_option("--box", flags->box, "the tool stays within: x0,y0,z0,x1,y1,z1; goes into the cell file");
  calibrate->add_option("--tool", flags->tool, "the task whose tool is held; goes into the cell file");
  calibrate->add_option("--token-file", flags->token_file, "file with the token that the robot asks for");
  AddReal(*calibrate, "--reach", flags->settings.reach_m, 0.001, 0.3,
          "from a side to the tool while it stands beside, m");
  AddReal(*calibrate, "--clearance", flags->settings.clearance_m, 0.001, 0.2, "around the block between touches, m");
  AddReal(*calibrate, "--contact-force", flags->settings.contact_force_n, 1.0, 50.0, "that counts as a touch, N");
  calibrate->add_flag("--top-only", flags->top_only, "do not touch the sides");
  calibrate->add_flag("--start", flags->start, "the operator stands by and has said start: do not ask");
  calibrate->add_flag("--json", flags->json, "print the result as JSON");
  calibrate->callback([flags, &session] { Calibrate(*flags, session); });
}

}  // namespace feeler::cli
