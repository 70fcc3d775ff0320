// feeler records: episode records of several runs.
#include <memory>
#include <string>
#include <vector>

#include "feeler/cli/commands.h"
#include "feeler/cli/common/console.h"
#include "feeler/cli/common/outputs.h"
#include "feeler/evaluation/records/merge_records.h"
#include "feeler/evaluation/records/run_summary.h"

namespace feeler::cli {
namespace {

struct RecordsFlags {
  std::vector<std::string> files;
  std::string out;
  bool json = false;
};

void Merge(const RecordsFlags& flags) {
  RequireOutputs({{"--out", flags.out, FileKind::kRecords}}, flags.files);
  const evaluation::RunSummary summary = evaluation::Summarize(evaluation::MergeRecords(flags.files, flags.out));
  if (flags.json) {
    PrintJson(evaluation::ToJson(summary));
  } else {
    Print("{}: {} episodes of {} files\n{}", flags.out, summary.episodes, flags.files.size(),
          evaluation::ToText(summary));
  }
}

}  // namespace

void AddRecordsCommand(CLI::App& app, Session& /*session*/) {
  CLI::App* records = app.add_subcommand("records", "Put records of episodes together");
  records->require_subcommand(1);
  auto flags = std::make_shared<RecordsFlags>();
  CLI::App* merge = records->add_subcommand("merge", "Put the records of all shards of a run together");
  merge->add_option("files", flags->files, "what feeler run --shard I/N --out wrote, every shard")->required();
  merge->add_option("--out", flags->out, "records to write; a file that exists is not overwritten")->required();
  merge->add_flag("--json", flags->json, "print the summary as JSON");
  merge->callback([flags] { Merge(*flags); });
}

}  // namespace feeler::cli
