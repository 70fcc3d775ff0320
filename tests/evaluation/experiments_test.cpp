// Laws of experiments: efforts and costs are compared as computed by hand, and what a limit cut short marks the ratio
// as a bound; a sample takes as many distinct problems from each stratum and depends on the seed alone; finished cells
// survive interruption, a cut-off line costs one cell, other settings are refused; a run that was interrupted and
// continued measures what an uninterrupted one does; a second run reruns nothing and leaves the same files; bounds only
// close.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>

#include "feeler/core/error.h"
#include "feeler/evaluation/paper/table1_plug.h"
#include "feeler/evaluation/paper/table3_ablation.h"
#include "feeler/evaluation/registry.h"
#include "feeler/evaluation/studies/bounds.h"
#include "tests/planner/synthetic_plug.h"

namespace feeler::evaluation {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

SolveRecord Solved(double cost, double cpu_s, std::int64_t expansions) {
  return {"converged", true, cost, 1.0, expansions, cpu_s, cpu_s};
}
SolveRecord CutShort(double cpu_s, std::int64_t expansions) {
  return {"time_limit", false, 0.0, 1.0, expansions, cpu_s, cpu_s};
}

std::string Scratch(const std::string& name) {
  std::string test = testing::UnitTest::GetInstance()->current_test_info()->name();  // tests run side by side
  std::ranges::replace(test, '/', '_');
  const std::string folder = testing::TempDir() + "/feeler_experiments_" + test + "_" + name;
  fs::remove_all(folder);
  fs::create_directories(folder);
  return folder;
}

std::string Read(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(Comparison, SpeedupIsTheRatioOfSumsAndItsGeometricMean) {
  const std::vector<SolveRecord> base = {Solved(10, 2.0, 300), Solved(20, 4.0, 100)};
  const std::vector<SolveRecord> other = {Solved(11, 1.0, 100), Solved(18, 1.0, 100)};
  const Speedup speedup = SpeedupOf(base, other);
  EXPECT_DOUBLE_EQ(speedup.cpu, 3.0);                       // 6 / 2
  EXPECT_DOUBLE_EQ(speedup.cpu_geometric, std::sqrt(8.0));  // 2 * 4
  EXPECT_DOUBLE_EQ(speedup.expansions, 2.0);                // 400 / 200
  EXPECT_DOUBLE_EQ(speedup.expansions_geometric, std::sqrt(3.0));
  EXPECT_EQ(speedup.bound, BoundKind::kExact);
  const Speedup back = SpeedupOf(other, base);
  EXPECT_DOUBLE_EQ(back.cpu * speedup.cpu, 1.0);
}

TEST(Comparison, WhatWasCutShortMarksABound) {
  const std::vector<SolveRecord> solved = {Solved(10, 1.0, 10)};
  const std::vector<SolveRecord> cut = {CutShort(30.0, 1000)};
  EXPECT_EQ(SpeedupOf(cut, solved).bound, BoundKind::kLower);
  EXPECT_DOUBLE_EQ(SpeedupOf(cut, solved).cpu, 30.0);
  EXPECT_EQ(SpeedupOf(solved, cut).bound, BoundKind::kUpper);
  EXPECT_EQ(SpeedupOf(cut, cut).bound, BoundKind::kUnknown);
}

TEST(Comparison, CostsAreComparedWhereBothHaveOne) {
  const std::vector<SolveRecord> base = {Solved(10, 1, 1), CutShort(1, 1), Solved(20, 1, 1), Solved(5, 1, 1)};
  const std::vector<SolveRecord> other = {Solved(12, 1, 1), Solved(33, 1, 1), Solved(20, 1, 1), CutShort(1, 1)};
  const std::vector<SolveRecord> reference = {Solved(9, 1, 1), Solved(30, 1, 1), Solved(19, 1, 1), Solved(5, 1, 1)};
  const RelativeCost both = RelativeCostOf(base, other);
  EXPECT_EQ(both.attempts, 2);
  EXPECT_DOUBLE_EQ(both.mean, 1.1);  // (1.2 + 1.0) / 2
  const RelativeCost rest = RelativeCostOfRest(reference, base, other);
  EXPECT_EQ(rest.attempts, 1);
  EXPECT_DOUBLE_EQ(rest.mean, 1.1);  // 33 / 30
  EXPECT_EQ(RelativeCostOf({CutShort(1, 1)}, {Solved(1, 1, 1)}).attempts, 0);
}

TEST(Comparison, RecordsSurviveJson) {
  for (const SolveRecord& record : {Solved(49.1 / 3, 0.1, 123456789012), CutShort(30.5, 7)}) {
    const SolveRecord back = RecordFromJson(json::parse(ToJson(record).dump()));
    EXPECT_EQ(ToJson(back), ToJson(record));
    EXPECT_EQ(back.complete, record.complete);
    EXPECT_EQ(back.expected_cost, record.expected_cost);
  }
}

TEST(Sample, TakesDistinctProblemsFromEachStratum) {
  const planner::ProblemFamily family = planner::ParseProblemFamily("2..15x2..15x2..15");
  const planner::ProblemFamily sample = DrawSample(family, 5, 8, 1);
  EXPECT_EQ(sample.problems.size(), 40U);
  EXPECT_EQ(std::set(sample.problems.begin(), sample.problems.end()).size(), 40U);
  EXPECT_EQ(sample.problems, DrawSample(family, 5, 8, 1).problems);
  EXPECT_NE(sample.problems, DrawSample(family, 5, 8, 2).problems);

  std::vector<int> counts;
  for (const planner::Extents& extents : family.problems) counts.push_back(extents.Count());
  std::sort(counts.begin(), counts.end());
  std::vector<int> drawn;
  for (const planner::Extents& extents : sample.problems) drawn.push_back(extents.Count());
  std::sort(drawn.begin(), drawn.end());
  for (std::size_t quintile = 0; quintile < 5; ++quintile) {
    EXPECT_GE(drawn[quintile * 8], counts[counts.size() * quintile / 5]);
    EXPECT_LE(drawn[quintile * 8 + 7], counts[counts.size() * (quintile + 1) / 5 - 1]);
  }
  EXPECT_THROW(DrawSample(planner::ParseProblemFamily("2x2x2..5"), 2, 3, 1), InputError);
}

TEST(CellStore, KeepsWhatWasFinished) {
  const std::string path = Scratch("cells") + "/x.partial.jsonl";
  const json settings = {{"limit", 30.5}};
  {
    CellStore store(path, settings);
    EXPECT_EQ(store.Find("a"), nullptr);
    store.Put("a", {{"cost", 1.0 / 3}});
    store.Put("b", 2);
  }
  const std::string whole = Read(path);
  EXPECT_EQ(CellStore(path, settings).Find("a")->at("cost").get<double>(), 1.0 / 3);
  EXPECT_EQ(Read(path), whole);
  EXPECT_THROW(CellStore(path, {{"limit", 31.0}}), InputError);

  std::ofstream(path, std::ios::binary) << whole.substr(0, whole.size() - 5);  // killed while writing b
  {
    CellStore store(path, settings);
    EXPECT_NE(store.Find("a"), nullptr);
    EXPECT_EQ(store.Find("b"), nullptr);
    store.Put("b", 2);
  }
  EXPECT_EQ(Read(path), whole);

  std::string damaged = whole;
  damaged[whole.find("\"cell\"") + 1] = '"';
  std::ofstream(path, std::ios::binary) << damaged;
  EXPECT_THROW(CellStore(path, settings), InputError);
}

TEST(Registry, KnowsItsExperimentsAndWhatThePaperPrints) {
  EXPECT_EQ(FindExperiment("table1-plug").name, "table1-plug");
  try {
    FindExperiment("table9");
    FAIL();
  } catch (const InputError& e) {
    for (const Experiment& experiment : Experiments()) {
      EXPECT_NE(std::string(e.what()).find(experiment.name), std::string::npos);
    }
  }
  EXPECT_EQ(PrintedSolver("table1_plug_database", "e-rtdp-bel", 3)->relative_speedup, 283.13);
  EXPECT_EQ(PrintedSolver("table1_plug_database", "rtdp-bel", 1)->success_percent, 78.9);
  EXPECT_EQ(PrintedSolver("table1_plug_database", "certified", 1).has_value(), false);
  EXPECT_EQ(PrintedVariant("table3_ablation_plug", "naive")->relative_cost, 0.95);
  for (const DatabaseTable& table : {Table1Plug(), Table3Ablation()}) {
    EXPECT_EQ(table.rows[table.reference].solver.options.solver, planner::SolverKind::kCertified);
    for (const TableRow& row : table.rows) {
      EXPECT_EQ(row.printed.has_value(), row.solver.setting == "paper") << row.solver.label;
      if (row.solver.setting != "paper") continue;
      EXPECT_EQ(row.solver.options.heuristic, planner::HeuristicKind::kLines);
      EXPECT_FALSE(row.solver.options.canonical_translation);
    }
  }
}

const PlanningCase& SmallPlug() {
  static const PlanningCase kCase = {planner::testing::MakePlugTask(), planner::testing::MakePlugMap(false, {8, 7, 6}),
                                     "synthetic"};
  return kCase;
}

/// A few small problems under a budget that does not depend on the clock.
SampleProtocol SmallProtocol() {
  SampleProtocol protocol;
  protocol.family = "2..3x2..3x1..3";
  protocol.strata = 2;
  protocol.per_stratum = 2;
  protocol.solver_seeds = 2;
  protocol.cpu_limit_s = 1e6;
  protocol.expansion_limit = 3000;
  return protocol;
}

Experiment SmallTable(DatabaseTable (*table)()) {
  const auto run = [table](const ExperimentRequest& request) {
    return RunDatabaseTable(SmallPlug(), table(), SmallProtocol(), request);
  };
  return {table().name, "", run, false, true};
}

ExperimentRequest RequestIn(const std::string& folder) {
  ExperimentRequest request;
  request.out = folder;
  request.command = "test";
  request.jobs = Parallelism(2);
  return request;
}

/// The attempts without what the clock measured.
json Untimed(const std::string& folder, const std::string& name) {
  json attempts = json::parse(Read(folder + "/" + name + ".json")).at("details").at("attempts");
  for (json& attempt : attempts) {
    attempt.erase("cpu_s");
    attempt.erase("wall_s");
  }
  return attempts;
}

class DatabaseTables : public ::testing::TestWithParam<DatabaseTable (*)()> {};

TEST_P(DatabaseTables, HoldARowASolverWithSuccessIntervalsAndRatios) {
  const DatabaseTable table = GetParam()();
  const ExperimentResult result =
      RunDatabaseTable(SmallPlug(), table, SmallProtocol(), RequestIn(Scratch("rows_" + table.name)));
  ASSERT_TRUE(result.complete);
  ASSERT_EQ(result.table.rows.size(), table.rows.size() + table.family_rows.size());
  EXPECT_EQ(result.seeds, (std::vector<std::uint64_t>{1, 2}));
  const auto column = [&](std::size_t row, const std::string& name) {
    const auto at = std::find(result.table.columns.begin(), result.table.columns.end(), name);
    return result.table.rows[row].at(static_cast<std::size_t>(at - result.table.columns.begin()));
  };
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    SCOPED_TRACE(table.rows[i].solver.label);
    EXPECT_EQ(column(i, "attempts"), 8);
    EXPECT_EQ(column(i, "attempts_at_limit"), 8 - column(i, "solved").get<int>());
    EXPECT_DOUBLE_EQ(column(i, "success_percent"), 12.5 * column(i, "solved").get<int>());
    EXPECT_LE(column(i, "success_low_percent"), column(i, "success_percent"));
    EXPECT_GE(column(i, "success_high_percent"), column(i, "success_percent"));
    EXPECT_EQ(column(i, "relative_cost_to_base_attempts").get<int>() +
                  column(i, "rest_cost_to_certified_attempts").get<int>(),
              column(i, "solved"));
    if (column(i, "solved") > 0) {
      EXPECT_GE(column(i, "cost_to_certified").get<double>(), 1.0 / 1.2);
    }
    EXPECT_NE(result.text.find(table.rows[i].solver.label), std::string::npos);
  }
  EXPECT_EQ(column(table.base, "relative_speedup_cpu"), 1.0);
  EXPECT_EQ(column(table.base, "relative_speedup_expansions"), 1.0);
  EXPECT_EQ(column(table.reference, "success_percent"), 100.0);
  for (std::size_t i = 0; i < table.family_rows.size(); ++i) {
    const std::size_t row = table.rows.size() + i;
    SCOPED_TRACE(table.family_rows[i].solver.label);
    EXPECT_EQ(column(row, "problems"), "family");
    EXPECT_EQ(column(row, "attempts"), 12);  // every problem once
    EXPECT_EQ(column(row, "solved"), 12);
    EXPECT_NE(result.text.find(table.family_rows[i].solver.label), std::string::npos);
  }
  EXPECT_EQ(column(table.rows.size() + table.family_base, "relative_speedup_expansions"), 1.0);
  const double gap = result.details.at("cost_over_start_heuristic").at("low");
  EXPECT_GE(gap, 1.0 - 1e-9);  // the heuristic is admissible
}

TEST_P(DatabaseTables, InterruptedAndContinuedMeasureTheSame) {
  const std::string name = GetParam()().name;
  const std::string whole = Scratch("whole_" + name);
  ASSERT_TRUE(RunExperiment(SmallTable(GetParam()), RequestIn(whole)).complete);

  const std::string cut = Scratch("cut_" + name);
  int interruptions = 0;
  while (true) {
    CancellationToken token;
    ExperimentRequest request = RequestIn(cut);
    request.cancellation = &token;
    int calls = 0;
    request.progress = [&](std::int64_t done, std::int64_t total) {
      EXPECT_LE(done, total);
      if (++calls > 5 + 6 * interruptions) token.Cancel();
    };
    const ExperimentOutcome outcome = RunExperiment(SmallTable(GetParam()), request);
    if (outcome.complete) break;
    EXPECT_FALSE(fs::exists(cut + "/" + name + ".csv"));
    ASSERT_LT(++interruptions, 100);
  }
  EXPECT_GE(interruptions, 2);
  EXPECT_EQ(Untimed(cut, name), Untimed(whole, name));
}

TEST_P(DatabaseTables, SecondRunRerunsNothingAndLeavesTheSameFiles) {
  const std::string name = GetParam()().name;
  const std::string folder = Scratch("again_" + name);
  const ExperimentOutcome first = RunExperiment(SmallTable(GetParam()), RequestIn(folder));
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::directory_iterator(folder)) files[entry.path()] = Read(entry.path());
  EXPECT_EQ(files.size(), 4U);  // CSV, JSON, manifest, finished cells
  const ExperimentOutcome second = RunExperiment(SmallTable(GetParam()), RequestIn(folder));
  EXPECT_EQ(second.text, first.text);
  for (const auto& [file, content] : files) EXPECT_EQ(Read(file), content) << file;

  ExperimentRequest more = RequestIn(folder);  // the finished seeds stay as they are
  more.solver_seeds = 3;
  ASSERT_TRUE(RunExperiment(SmallTable(GetParam()), more).complete);
  ASSERT_TRUE(RunExperiment(SmallTable(GetParam()), RequestIn(folder)).complete);
  EXPECT_EQ(Read(folder + "/" + name + ".csv"), files.at(folder + "/" + name + ".csv"));

  ExperimentRequest other = RequestIn(folder);
  other.seed = 2;
  EXPECT_THROW(RunExperiment(SmallTable(GetParam()), other), InputError);
}

INSTANTIATE_TEST_SUITE_P(Tables, DatabaseTables,
                         ::testing::Values(Table1Plug, Table3Ablation, Table3AblationWithOrientations),
                         [](const auto& parameter) { return "Table" + std::to_string(parameter.index); });

TEST(Bounds, CloseAndStayOrdered) {
  BoundsProtocol protocol;
  protocol.extents = {"2x2x2", "3x3x2"};
  protocol.time_limit_s = 1e6;
  protocol.expansion_limit = 3000;
  const std::string folder = Scratch("bounds");
  const Experiment bounds = {kBoundsName, "", [&](const ExperimentRequest& request) {
                               return RunBoundsOn({{"closed", SmallPlug()}}, protocol, request);
                             }};
  const ExperimentOutcome outcome = RunExperiment(bounds, RequestIn(folder));
  ASSERT_TRUE(outcome.complete);
  const json result = json::parse(Read(folder + "/bounds.json"));
  std::string extents;
  double lower = 0.0, upper = 0.0;
  for (const json& row : result.at("rows")) {
    if (row[1] != extents) {
      extents = row[1];
      lower = 0.0;
      upper = std::numeric_limits<double>::infinity();
    }
    EXPECT_GE(row[6].get<double>(), lower - 1e-9);
    lower = row[6].get<double>();
    if (row[7].is_null()) continue;
    EXPECT_LE(row[7].get<double>(), upper + 1e-9);
    upper = row[7].get<double>();
    EXPECT_GE(upper, lower - 1e-9);
    EXPECT_NEAR(row[8].get<double>(), upper / lower, 1e-12);
  }
  const std::string csv = Read(folder + "/bounds.csv");
  EXPECT_EQ(RunExperiment(bounds, RequestIn(folder)).text, outcome.text);
  EXPECT_EQ(Read(folder + "/bounds.csv"), csv);
}

}  // namespace
}  // namespace feeler::evaluation
