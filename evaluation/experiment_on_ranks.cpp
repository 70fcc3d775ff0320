#include "feeler/evaluation/experiment_on_ranks.h"

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <numeric>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "feeler/core/error.h"
#include "feeler/core/file_output.h"
#include "feeler/core/interrupted.h"
#include "feeler/env/model/fingerprint.h"
#include "feeler/env/model/task_file.h"
#include "feeler/version.h"
#include "feeler/workflow/scale/ordered_pieces.h"

namespace feeler::evaluation {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

std::string FolderOf(const ExperimentRequest& request, std::int64_t index, int count) {
  return request.out + "/ranks/" + std::to_string(index) + "-of-" + std::to_string(count);
}

/// What all ranks must agree on.
std::string IdentityOf(const Experiment& experiment, const ExperimentRequest& request) {
  const env::TaskModel model = env::LoadTask(request.task.empty() ? "plug" : request.task);
  return json{{"command", "experiment " + experiment.name},
              {"version", FEELER_VERSION},
              {"fingerprint of the task", env::Fingerprint(model, env::Opening::kClosed)},
              {"quick", request.quick},
              {"seed", request.seed},
              {"solver seeds", request.solver_seeds}}
      .dump();
}

/// The cells and records in a folder, by their names in it.
std::string Pack(const std::string& folder) {
  json files = json::object();
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file() || entry.path().extension() != ".jsonl") continue;
    std::ifstream in(entry.path(), std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(in), {}};
    if (!in) throw InputError(entry.path().string(), "cannot be read", "check its permissions");
    files[fs::relative(entry.path(), folder).string()] = json::binary({bytes.begin(), bytes.end()});
  }
  const std::vector<std::uint8_t> packed = json::to_msgpack(files);
  return {packed.begin(), packed.end()};
}

void Unpack(const std::string& bytes, const std::string& folder) {
  const json files = json::from_msgpack(bytes);
  for (const auto& [name, content] : files.items()) {
    const fs::path path = fs::path(folder) / name;
    std::error_code error;
    fs::create_directories(path.parent_path(), error);
    const auto& binary = content.get_binary();
    WriteFileAtomically(path.string(), {reinterpret_cast<const char*>(binary.data()), binary.size()});
  }
}

}  // namespace

ExperimentOutcome RunExperimentOnRanks(const Experiment& experiment, const ExperimentRequest& request,
                                       workflow::Ranks& ranks) {
  if (!experiment.takes_shard) {
    throw InputError("ranks", "experiment " + experiment.name + " is measured in one go", "start it without mpirun");
  }
  if (request.shard || !request.from.empty()) {
    throw InputError(request.shard ? "--shard" : "--from", "is for jobs without ranks", "start it without mpirun");
  }
  const int count = ranks.size();
  const auto make_worker = [&] {
    return [&](std::int64_t index) {
      ExperimentRequest part = request;
      part.out = FolderOf(request, index, count);
      part.shard = workflow::Shard{static_cast<int>(index), count};
      RunExperiment(experiment, part);
      if (request.cancellation != nullptr && request.cancellation->cancelled()) throw Interrupted();
      return Pack(part.out);
    };
  };
  const std::string identity = IdentityOf(experiment, request);
  if (ranks.rank() > 0) {
    workflow::ServePieces(ranks, identity, Parallelism(1), make_worker);
    return {};
  }
  ranks.Assemble(identity);
  std::vector<std::int64_t> shards(static_cast<std::size_t>(count));
  std::iota(shards.begin(), shards.end(), 1);
  ExperimentRequest rest = request;
  try {
    workflow::RunPiecesInOrder(
        shards, Parallelism(1), &ranks, make_worker,
        [&](std::size_t i, const std::string& bytes) {
          rest.from.push_back(FolderOf(request, shards[i], count));
          Unpack(bytes, rest.from.back());
        },
        request.cancellation);
  } catch (const Interrupted&) {
    return {.complete = false, .partial_file = request.out + "/ranks", .text = ""};
  }
  if (rest.from.size() < shards.size()) return {.complete = false, .partial_file = request.out + "/ranks", .text = ""};
  ExperimentOutcome outcome = RunExperiment(experiment, rest);
  std::error_code ignored;
  if (outcome.complete) fs::remove_all(request.out + "/ranks", ignored);
  return outcome;
}

}  // namespace feeler::evaluation
