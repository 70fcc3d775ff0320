#include "feeler/evaluation/harness/solver_sweep.h"

#include <algorithm>
#include <cmath>
#include <ranges>
#include <tuple>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/core/random.h"
#include "feeler/planner/belief/belief_graph.h"
#include "feeler/planner/bounds/planning_tables.h"
#include "feeler/policies/io/policy_blob.h"

namespace feeler::evaluation {
namespace {

std::string ToHex(const std::string& bytes) {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string hex;
  hex.reserve(bytes.size() * 2);
  for (const char c : bytes) {
    const auto byte = static_cast<unsigned char>(c);
    hex += kDigits[byte >> 4];
    hex += kDigits[byte & 15];
  }
  return hex;
}

/// Whatever is no digit becomes a wrong byte, which the checksum of the blob finds.
std::string FromHex(const std::string& hex) {
  const auto digit = [](char c) { return c >= 'a' ? c - 'a' + 10 : c - '0'; };
  std::string bytes;
  bytes.reserve(hex.size() / 2);
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2) {
    bytes += static_cast<char>(static_cast<unsigned char>(digit(hex[i]) << 4 | digit(hex[i + 1])));
  }
  return bytes;
}

nlohmann::json LimitJson(double limit) { return std::isfinite(limit) ? nlohmann::json(limit) : nlohmann::json(); }

}  // namespace

planner::ProblemFamily DrawSample(const planner::ProblemFamily& family, int strata, int per_stratum,
                                  std::uint64_t seed) {
  std::vector<planner::Extents> sorted = family.problems;
  std::sort(sorted.begin(), sorted.end(), [](const planner::Extents& a, const planner::Extents& b) {
    return std::tuple(a.Count(), a) < std::tuple(b.Count(), b);
  });
  planner::ProblemFamily sample;
  sample.spec = family.spec + ", " + std::to_string(per_stratum) + " from each of " + std::to_string(strata) +
                " strata of size, seed " + std::to_string(seed);
  for (int stratum = 0; stratum < strata; ++stratum) {
    const auto edge = [&](int i) {
      return sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() * static_cast<std::size_t>(i) /
                                                          static_cast<std::size_t>(strata));
    };
    std::vector<planner::Extents> pool(edge(stratum), edge(stratum + 1));
    if (static_cast<int>(pool.size()) < per_stratum) {
      throw InputError("sample", "the family " + family.spec + " has too few problems", "give a larger family");
    }
    RandomStream random(seed, static_cast<std::uint64_t>(stratum), "experiment-sample");
    for (int i = 0; i < per_stratum; ++i) {  // Fisher and Yates
      const auto first = static_cast<std::size_t>(i);
      std::swap(pool[first], pool[first + random.Index(pool.size() - first)]);
      sample.problems.push_back(pool[first]);
    }
  }
  std::sort(sample.problems.begin(), sample.problems.end());
  return sample;
}

nlohmann::json ToJson(const SolverRow& row) {
  const planner::SolverOptions options = planner::WithFamilyBudget(row.options);  // what is used
  nlohmann::json document = {
      {"label", row.label},
      {"setting", row.setting},
      {"solver", planner::ToString(options.solver)},
      {"heuristic", planner::ToString(options.heuristic)},
      {"canonical_translation", options.canonical_translation},
      {"time_limit_s", LimitJson(options.time_limit_s)},
      {"cpu_limit_s", LimitJson(options.cpu_limit_s)},
      {"memory_limit_bytes", options.memory_limit_bytes},
  };
  if (options.expansion_limit != std::numeric_limits<std::int64_t>::max()) {
    document["expansion_limit"] = options.expansion_limit;
  }
  if (row.heuristic_share != 1.0) document["heuristic_share"] = row.heuristic_share;
  if (options.solver == planner::SolverKind::kCertified) {
    document["gap"] = options.gap;
  } else {
    document["epsilon"] = options.epsilon;
  }
  if (options.solver == planner::SolverKind::kERtdpBel) {
    document["experience"] = planner::ToString(row.experience);
    document["jumps"] = planner::ToString(options.jumps);
    document["order"] = row.order == planner::ProblemOrder::kUncertainty ? "uncertainty" : "random";
  }
  return document;
}

/// Keeps results as cells; policies only where they may serve as experience.
class SolverSweep::Sink : public planner::PolicySink {
 public:
  Sink(const SolverSweep& sweep, const SolverRow& row, std::uint64_t seed) : sweep_(sweep), row_(row), seed_(seed) {}

  /// A row whose policies are not kept is measured whole or not at all.
  bool Done(const planner::Extents& extents) override {
    return (sweep_.context_.keep_policies || !NeedsPolicies()) && Find(extents) != nullptr;
  }

  std::optional<planner::PolicyGraph> Load(const planner::Extents& extents) override {
    const nlohmann::json* cell = Find(extents);
    if (cell == nullptr || !cell->contains("policy")) return std::nullopt;
    return policies::DecodePolicyBlob(FromHex(cell->at("policy").get<std::string>()),
                                      sweep_.context_.cells->path() + ", " + sweep_.CellOf(row_, seed_, extents));
  }

  void Store(const planner::Extents& extents, const planner::Problem& /*problem*/,
             const planner::SolverResult& result) override {
    nlohmann::json cell = ToJson(RecordOf(result));
    if (sweep_.context_.keep_policies && NeedsPolicies() && result.complete()) {
      cell["policy"] = ToHex(policies::EncodePolicyBlob(*result.policy));
    }
    sweep_.context_.cells->Put(sweep_.CellOf(row_, seed_, extents), std::move(cell));
  }

  const nlohmann::json* Find(const planner::Extents& extents) const {
    return sweep_.context_.cells->Find(sweep_.CellOf(row_, seed_, extents));
  }

 private:
  bool NeedsPolicies() const { return row_.options.solver == planner::SolverKind::kERtdpBel; }

  const SolverSweep& sweep_;
  const SolverRow& row_;
  std::uint64_t seed_;
};

SolverSweep::SolverSweep(PlanningCase planning_case, planner::ProblemFamily sample, std::vector<SolverRow> rows,
                         std::vector<std::uint64_t> seeds, SweepContext context)
    : case_(std::move(planning_case)),
      sample_(std::move(sample)),
      rows_(std::move(rows)),
      seeds_(std::move(seeds)),
      context_(std::move(context)) {}

std::string SolverSweep::CellOf(const SolverRow& row, std::uint64_t seed, const planner::Extents& extents) const {
  return row.label + " seed " + std::to_string(seed) + " " + planner::ToString(extents);
}

std::shared_ptr<const planner::PlanningTables> SolverSweep::TablesFor(const SolverRow& row) {
  auto& tables = tables_[{row.options.heuristic, row.heuristic_share}];
  if (tables) return tables;
  const planner::Problem problem = planner::MakeCuboidProblem(case_.task, case_.map, planner::LargestExtents(sample_));
  if (row.heuristic_share == 1.0) {
    tables = planner::BuildPlanningTables(problem, row.options, context_.jobs, context_.store.get());
  } else {
    const auto weakened = std::make_shared<planner::PlanningTables>(problem, row.options, context_.jobs);
    weakened->WeakenHeuristics(row.heuristic_share);
    tables = weakened;
  }
  return tables;
}

bool SolverSweep::Run() {
  std::int64_t before = 0;
  const std::vector<planner::Extents> own =
      context_.shard ? workflow::ProblemsOfShard(sample_, *context_.shard) : sample_.problems;
  const auto total = static_cast<std::int64_t>(own.size() * rows_.size() * seeds_.size());
  // The last rows first: the base, which is the slowest, has the rest beside it if it is interrupted.
  for (const SolverRow& row : std::ranges::reverse_view(rows_)) {
    for (const std::uint64_t seed : seeds_) {
      Sink sink(*this, row, seed);
      const bool finished = std::all_of(own.begin(), own.end(),
                                        [&](const planner::Extents& extents) { return sink.Find(extents) != nullptr; });
      if (!finished) {
        planner::PreprocessOptions options;
        options.solver = row.options;
        options.solver.seed = seed;
        options.seed = seed;
        options.order = row.order;
        options.experience = row.experience;
        options.jobs = context_.jobs;
        if (context_.shard) options.only = std::make_shared<const std::vector<planner::Extents>>(own);
        options.tables = TablesFor(row);
        options.cancellation = context_.cancellation;
        options.progress = [&](std::int64_t done, std::int64_t) {
          if (context_.progress) context_.progress(before + done, total);
        };
        if (planner::Preprocess(case_.task, case_.map, sample_, options, sink).cancelled) return false;
      }
      before += static_cast<std::int64_t>(own.size());
      if (context_.progress) context_.progress(before, total);
    }
  }
  return !context_.shard;
}

std::vector<SolveRecord> SolverSweep::Records(std::size_t row) const {
  std::vector<SolveRecord> records;
  for (const std::uint64_t seed : seeds_) {
    for (const planner::Extents& extents : sample_.problems) {
      records.push_back(RecordFromJson(*context_.cells->Find(CellOf(rows_[row], seed, extents))));
    }
  }
  return records;
}

std::vector<double> SolverSweep::StartHeuristics(std::size_t row) {
  const auto tables = TablesFor(rows_[row]);
  std::vector<double> values;
  for (const planner::Extents& extents : sample_.problems) {
    const planner::Problem problem = planner::MakeCuboidProblem(case_.task, case_.map, extents);
    planner::BeliefGraph graph(problem, tables->masks(), false);
    const auto heuristic = tables->MakeHeuristic(problem, graph.sets());
    graph.SetHeuristic(heuristic.get());
    const planner::BeliefId start = graph.Start();
    values.push_back(start == planner::kNoBelief ? 0.0 : graph.Heuristic(start) / graph.Weight(start));
  }
  return values;
}

nlohmann::json SolverSweep::RecordsJson() const {
  nlohmann::json list = nlohmann::json::array();
  for (const SolverRow& row : rows_) {
    for (const std::uint64_t seed : seeds_) {
      for (const planner::Extents& extents : sample_.problems) {
        nlohmann::json record = ToJson(RecordFromJson(*context_.cells->Find(CellOf(row, seed, extents))));
        record["row"] = row.label;
        record["seed"] = seed;
        record["extents"] = planner::ToString(extents);
        list.push_back(std::move(record));
      }
    }
  }
  return list;
}

}  // namespace feeler::evaluation
