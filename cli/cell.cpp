// feeler cell: what is known of a robot's cell.
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <string>

#include "feeler/cli/commands.h"
#include "feeler/cli/common/console.h"
#include "feeler/cli/common/numbers.h"
#include "feeler/cli/common/outputs.h"
#include "feeler/cli/execute/flags.h"
#include "feeler/cli/execute/operator.h"
#include "feeler/core/error.h"
#include "feeler/env/model/task_file.h"
#include "feeler/execution/remote/calibrate.h"
#include "feeler/execution/remote/dialler.h"
#include "feeler/execution/remote/token_file.h"
#include "feeler/policies/storage/task_bundle.h"

namespace feeler::cli {
namespace {

struct CellFlags {
  std::string robot;
  std::string wire = "json";
  std::string block;
  std::string box;
  std::string tool;
  std::string token_file;
  double link_timeout_s = execution::kLinkTimeout_s;
  std::string out;
  std::string recover = "ask";
  double speed = 1.0;
  execution::CalibrationSettings settings;
  bool top_only = false;
  bool start = false;
  bool json = false;
};

/// The name of the task whose tool is held, which a task, a database or a bundle tells.
std::string ToolOf(const std::string& given) {
  constexpr const char* kBundle = ".bundle";
  if (given.empty()) throw InputError("--tool", "missing", "give the task whose tool is held, e.g. plug");
  if (given.ends_with(kBundle)) return policies::ReadBundle(given).task.name;
  if (given.ends_with(".db")) return policies::ReadBundleOf(policies::Database::OpenReadOnly(given)).task.name;
  return env::LoadTask(given).task.name;
}

std::unique_ptr<execution::RemoteRobot> DialRobot(const CellFlags& flags, execution::Dialler& dialler,
                                                  Session& session) {
  std::unique_ptr<execution::RemoteRobot> robot = dialler.Dial();
  const execution::WelcomeReply& welcome = robot->welcome();
  Operator person(session.cancellation);
  if (robot->State().mode == execution::RobotMode::kProtectiveStop) {
    if (flags.recover == "never" ||
        !person.Agrees("The robot is in a protective stop. Look at it; press Enter to recover: ")) {
      throw NegativeResult("robot", "is in a protective stop", "look at it, then recover");
    }
    robot->Recover();
  }
  if (!welcome.simulated && !flags.start) {
    const std::string question =
        fmt::format("{} is about to touch the block. Is the cell clear, and the stop at hand? Press Enter to start: ",
                    welcome.robot);
    if (!person.Agrees(question))
      throw NegativeResult("operator", "did not start the robot", "answer, or give --start");
  }
  robot->Start();
  return robot;
}

void Tell(const CellFlags& flags, const execution::CellFile& cell) {
  const auto known = [](const std::optional<double>& value) { return value ? nlohmann::json(*value) : nullptr; };
  if (flags.json) {
    PrintJson({{"tool", cell.tool},
               {"force_bias_n", known(cell.force_bias_n)},
               {"force_noise_n", known(cell.force_noise_n)},
               {"contact_force_n", known(cell.contact_force_n)},
               {"stiffness_n_m", known(cell.stiffness_n_m)},
               {"reaction_time_s", known(cell.reaction_time_s)},
               {"tool_offset_m", {cell.tool_offset_m.x(), cell.tool_offset_m.y(), cell.tool_offset_m.z()}}});
    return;
  }
  Print(
      "bias {:.2f} N, noise {:.2f} N, contacts from {:.1f} N on; stiffness {}, reaction {};\n"
      "tool centre point off by {:.2f} {:.2f} {:.2f} mm\n",
      *cell.force_bias_n, *cell.force_noise_n, *cell.contact_force_n,
      cell.stiffness_n_m ? fmt::format("{:.0f} N/m", *cell.stiffness_n_m) : "not measured",
      cell.reaction_time_s ? fmt::format("{:.1f} ms", 1e3 * *cell.reaction_time_s) : "not measured",
      1e3 * cell.tool_offset_m.x(), 1e3 * cell.tool_offset_m.y(), 1e3 * cell.tool_offset_m.z());
}

void Calibrate(const CellFlags& flags, Session& session) {
  RequireOutputs({{"--out", flags.out, FileKind::kCell}}, {flags.token_file});
  const execution::WorkspaceBox corners = ParseBox("--block", flags.block);
  const execution::KnownBlock block{corners.min_m, corners.max_m};
  const std::string tool = ToolOf(flags.tool);
  const auto tell = [](const std::string& what) { Note("feeler: {}\n", what); };
  execution::SafetyLimits limits;
  if (!flags.box.empty()) limits.box = ParseBox("--box", flags.box);
  execution::RemoteOptions remote;
  remote.token = execution::ReadTokenFile(flags.token_file);
  remote.form = flags.wire == "numbers" ? execution::WireForm::kNumbers : execution::WireForm::kJson;
  remote.link_timeout_s = flags.link_timeout_s;
  remote.cancellation = session.cancellation;
  execution::Dialler dialler("--robot", flags.robot, remote, tell);
  const std::unique_ptr<execution::RemoteRobot> robot = DialRobot(flags, dialler, session);
  limits.robot = robot->welcome().capabilities;
  execution::CheckedRobot checked(*robot, limits);
  execution::CalibrationSettings settings = flags.settings;
  settings.sides = !flags.top_only;
  settings.tell = tell;
  settings.most_force_n = limits.robot.max_force_n;
  for (double* speed_m_s : {&settings.speed_m_s, &settings.fast_speed_m_s, &settings.way_speed_m_s}) {
    *speed_m_s = std::min(flags.speed * *speed_m_s, limits.robot.max_speed_m_s);
  }
  execution::CellFile cell = execution::Calibrate(checked, block, settings);
  cell.tool = tool;
  cell.robot = robot->welcome().robot;
  if (!flags.box.empty()) cell.box = limits.box;
  robot->Bye();
  execution::WriteCellFile(flags.out, cell);
  Tell(flags, cell);
}

}  // namespace

void AddCellCommand(CLI::App& app, Session& session) {
  CLI::App* command = app.add_subcommand("cell", "What is known of a robot's cell");
  command->require_subcommand(1);
  auto flags = std::make_shared<CellFlags>();
  CLI::App* calibrate = command->add_subcommand(
      "calibrate", "Touch a known block: sensor bias, tool centre point, stiffness, reaction time");
  calibrate
      ->add_option("--robot", flags->robot,
                   "HOST:PORT of the robot, or listen:HOST:PORT where its program dials in (docs/robot-protocol.md)")
      ->required();
  calibrate->add_option("--wire", flags->wire, "json, or numbers: what a robot controller's script speaks")
      ->check(CLI::IsMember({"json", "numbers"}))
      ->capture_default_str();
  calibrate->add_option("--block", flags->block, "the block, in the base frame: x0,y0,z0,x1,y1,z1 (m)")->required();
  calibrate->add_option("--out", flags->out, "cell file, which feeler execute --cell reads")->required();
  calibrate->add_option("--box", flags->box, "the tool stays within: x0,y0,z0,x1,y1,z1; goes into the cell file");
  calibrate
      ->add_option("--tool", flags->tool,
                   "the task whose tool is held, or its database or bundle; its name goes into the cell file")
      ->required();
  AddReal(*calibrate, "--link-timeout", flags->link_timeout_s, 0.02, 60.0,
          "a robot that may be silent for longer is refused, s (simulations say themselves)");
  calibrate->add_option("--token-file", flags->token_file, "file with the token that the robot asks for");
  AddReal(*calibrate, "--reach", flags->settings.reach_m, 0.001, 0.3,
          "from a side to the tool while it stands beside, m");
  AddReal(*calibrate, "--clearance", flags->settings.clearance_m, 0.001, 0.2, "around the block between touches, m");
  AddReal(*calibrate, "--contact-force", flags->settings.contact_force_n, 1.0, 50.0, "that counts as a touch, N");
  AddReal(*calibrate, "--speed", flags->speed, 0.01, 1.0, "all speeds times this");
  calibrate->add_option("--recover", flags->recover, "from a protective stop: ask, or never")
      ->check(CLI::IsMember({"ask", "never"}))
      ->capture_default_str();
  calibrate->add_flag("--top-only", flags->top_only, "do not touch the sides");
  calibrate->add_flag("--start", flags->start, "the operator stands by and has said start: do not ask");
  calibrate->add_flag("--json", flags->json, "print the result as JSON");
  calibrate->callback([flags, &session] { Calibrate(*flags, session); });
}

}  // namespace feeler::cli
