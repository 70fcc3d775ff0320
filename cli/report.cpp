// feeler report: one self-contained page from a folder of results.
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <system_error>

#include "feeler/cli/commands.h"
#include "feeler/cli/common/console.h"
#include "feeler/cli/common/numbers.h"
#include "feeler/cli/common/outputs.h"
#include "feeler/core/error.h"
#include "feeler/core/file_output.h"
#include "feeler/core/printable.h"
#include "feeler/evaluation/report/page.h"

namespace feeler::cli {
namespace {

struct ReportFlags {
  std::string folder;
  std::string out;
  double replay_megabytes = 12.0;
  bool json = false;
};

void Run(const ReportFlags& flags, Session& session) {
  (void)session;
  RequireOutputs({{"--out", flags.out, FileKind::kReport}}, {});  // what it reads is not of that kind
  const evaluation::Results results = evaluation::ReadResults(flags.folder);
  for (const evaluation::Fault& fault : results.faults) {
    Note("feeler: warning: {}\n", Printable(evaluation::ToString(fault)));
  }
  evaluation::ReportOptions options;
  options.replay_bytes = std::llround(1e6 * flags.replay_megabytes);
  const std::string page = evaluation::ReportPage(results, flags.folder, options);
  WriteFileAtomically(flags.out, page);

  std::size_t episodes = 0;
  for (const evaluation::ReportedRecords& records : results.records) episodes += records.episodes.size();
  std::error_code error;  // without a current folder the name stays as given
  const std::filesystem::path absolute = std::filesystem::absolute(flags.out, error);
  const std::string path = error ? flags.out : absolute.lexically_normal().string();
  if (flags.json) {
    PrintJson({{"experiments", results.experiments.size()},
               {"episodes", episodes},
               {"faults", results.faults.size()},
               {"bytes", page.size()},
               {"path", path}});
    return;
  }
  Print("{} experiments, {} episodes, {} faults, {:.1f} MB\n{}\n", results.experiments.size(), episodes,
        results.faults.size(), 1e-6 * static_cast<double>(page.size()), path);
}

}  // namespace

void AddReportCommand(CLI::App& app, Session& session) {
  auto flags = std::make_shared<ReportFlags>();
  CLI::App* command = app.add_subcommand("report", "One self-contained page: tables, figures, failures, replays");
  command->add_option("dir", flags->folder, "folder of results (feeler experiment --out) or records (feeler run --out)")
      ->required();
  command->add_option("--out", flags->out, "the page to write, e.g. report.html")->required();
  AddReal(*command, "--replay-megabytes", flags->replay_megabytes, 0.0, 1000.0,
          "how much of the page replays may take; failures come first");
  command->add_flag("--json", flags->json, "print what was reported as JSON");
  command->callback([flags, &session] { Run(*flags, session); });
}

}  // namespace feeler::cli
