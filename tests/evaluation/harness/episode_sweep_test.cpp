// Laws of episode experiments: the statistics are those of the records, nothing else; an interrupted sweep that is run
// again ends with the records of one that was never interrupted; a folder begun under other settings is refused; the
// records of shards are those of the whole, each of them asked for once.

#include "feeler/evaluation/harness/episode_sweep.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "feeler/core/error.h"
#include "feeler/evaluation/acceptance/acceptance_closed_loop.h"

namespace feeler::evaluation {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

json Record(bool inserted, double time_s, double error_m, int rungs, const std::string& reason) {
  json record = {{"localized", inserted},
                 {"inserted", inserted},
                 {"reason", reason},
                 {"sim_time_s", time_s},
                 {"episode", 0},
                 {"policy_moves", 4},
                 {"contacts", 2},
                 {"path_length_m", 0.5},
                 {"peak_force_n", 10 * time_s},
                 {"error", {{"lateral_m", error_m}}},
                 {"ladder", json::array()},
                 {"timing", {{"cpu_s", 0.25}}}};
  for (int i = 0; i < rungs; ++i) record["ladder"].push_back({{"rung", "refit"}});
  return record;
}

TEST(EpisodeStatisticsTest, CountsWhatTheRecordsSay) {
  std::vector<json> records = {Record(true, 4.0, 0.001, 0, "inserted"), Record(true, 6.0, 0.002, 2, "inserted"),
                               Record(false, 50.0, 0.009, 1, "stuck: at 3 mm"),
                               Record(false, 60.0, 0, 0, "stuck: else")};
  records[3]["error"] = nullptr;
  records[3]["episode"] = 17;
  const EpisodeStatistics s = StatisticsOf(records);
  EXPECT_EQ(s.inserted.successes, 2);
  EXPECT_EQ(s.inserted.trials, 4);
  EXPECT_EQ(s.ladder_used.successes, 2);
  EXPECT_DOUBLE_EQ(s.sim_time_mean_s, 5.0) << "failed episodes have no time to insertion";
  EXPECT_DOUBLE_EQ(s.sim_time_max_s, 6.0);
  EXPECT_DOUBLE_EQ(s.lateral_error_median_m, 0.002);
  EXPECT_DOUBLE_EQ(s.peak_force_max_n, 600.0) << "of all episodes";
  EXPECT_EQ(s.failures, (json{{"stuck", 2}}));
  EXPECT_EQ(s.failed, (std::vector<std::int64_t>{0, 17}));
  EXPECT_EQ(StatisticsOf({}).inserted.trials, 0);
}

TEST(AcceptanceTest, RowsHaveTheSizesAskedFor) {
  std::int64_t plug = 0;
  for (const AcceptanceRow& row : AcceptanceClosedLoopRows(false)) {
    std::int64_t episodes = 0;
    for (const EpisodeSetting& setting : row.settings) episodes += setting.episodes;
    EXPECT_GE(episodes, row.settings.size() > 1 ? 1000 : 300) << row.name;
    plug += row.settings.size() == 4 ? 1 : 0;
  }
  EXPECT_EQ(plug, 6) << "ideal (two costs) and friction, bare and with ladder";
}

class EpisodeSweepTest : public ::testing::Test {
 protected:
  std::string Folder(const std::string& name) {
    const fs::path folder = fs::path(::testing::TempDir()) / ("episode_sweep_" + name);
    fs::remove_all(folder);
    return folder.string();
  }
  ExperimentRequest Request(const std::string& folder) {
    ExperimentRequest request;
    request.out = folder;
    request.seed = 5;
    return request;
  }
  static std::vector<json> WithoutTiming(std::vector<json> records) {
    for (json& record : records) record.erase("timing");
    return records;
  }
  EpisodeSetting setting_ = [] {
    EpisodeSetting setting;
    setting.name = "small";
    setting.extents = "2x2x2";
    setting.episodes = 3;
    return setting;
  }();
};

TEST_F(EpisodeSweepTest, AnInterruptedSweepGoesOn) {
  const ExperimentRequest whole = Request(Folder("whole"));
  EpisodeSweep uninterrupted("sweep", {setting_}, whole);
  ASSERT_TRUE(uninterrupted.Run());
  const std::vector<json> expected = uninterrupted.Records(setting_);
  ASSERT_EQ(expected.size(), 3U);

  CancellationToken token;
  ExperimentRequest request = Request(Folder("parts"));
  request.cancellation = &token;
  request.progress = [&](std::int64_t, std::int64_t) { token.Cancel(); };
  EpisodeSweep interrupted("sweep", {setting_}, request);
  EXPECT_FALSE(interrupted.Run());
  EXPECT_EQ(interrupted.Records(setting_).size(), 1U);
  {  // and the process died while it wrote
    std::ofstream file(request.out + "/sweep/small.jsonl", std::ios::app);
    file << R"({"episode":1,"see)";
  }
  request.cancellation = nullptr;
  request.progress = nullptr;
  EpisodeSweep resumed("sweep", {setting_}, request);
  ASSERT_TRUE(resumed.Run());
  EXPECT_EQ(WithoutTiming(resumed.Records(setting_)), WithoutTiming(expected));

  EpisodeSetting other = setting_;
  other.noise = "friction";
  EXPECT_THROW(EpisodeSweep("sweep", {other}, request).Run(), InputError);
}

TEST_F(EpisodeSweepTest, ShardsMakeTheWhole) {
  setting_.episodes = 4;
  EpisodeSetting bare = setting_;
  bare.name = "small bare";
  bare.ladder = false;
  bare.bare_of = setting_.name;
  const std::vector<EpisodeSetting> settings = {setting_, bare};
  const ExperimentRequest in_one = Request(Folder("in one"));
  EpisodeSweep whole("sweep", settings, in_one);
  ASSERT_TRUE(whole.Run());

  std::vector<std::string> folders;
  for (int i = 1; i <= 3; ++i) {
    ExperimentRequest request = Request(Folder("shard" + std::to_string(i)));
    request.shard = workflow::Shard{i, 3};
    EpisodeSweep shard("sweep", settings, request);
    EXPECT_FALSE(shard.Run()) << "a part is no whole";
    std::vector<std::int64_t> numbers;
    for (const json& record : shard.Records(setting_)) numbers.push_back(record.at("episode"));
    EXPECT_EQ(numbers, workflow::NumbersOfShard(0, 4, request.shard));
    folders.push_back(request.out);
  }
  ExperimentRequest merged = Request(Folder("merged"));
  merged.from = folders;
  int run = 0;
  merged.progress = [&](std::int64_t, std::int64_t) { ++run; };
  EpisodeSweep all("sweep", settings, merged);
  ASSERT_TRUE(all.Run());
  EXPECT_EQ(run, 0) << "everything was there";
  for (const EpisodeSetting& setting : settings) {
    EXPECT_EQ(WithoutTiming(all.Records(setting)), WithoutTiming(whole.Records(setting))) << setting.name;
  }

  ExperimentRequest twice = Request(Folder("twice"));
  twice.from = {folders[0], folders[1], folders[0]};
  EXPECT_THROW(EpisodeSweep("sweep", settings, twice).Run(), InputError);
  ExperimentRequest foreign = Request(Folder("foreign"));
  foreign.seed = 6;
  foreign.from = folders;
  EXPECT_THROW(EpisodeSweep("sweep", settings, foreign).Run(), InputError);
  // One is missing: what it would have brought is run.
  ExperimentRequest rest = Request(Folder("rest"));
  rest.from = {folders[0], folders[2]};
  EpisodeSweep completed("sweep", settings, rest);
  ASSERT_TRUE(completed.Run());
  EXPECT_EQ(WithoutTiming(completed.Records(setting_)), WithoutTiming(whole.Records(setting_)));
}

TEST_F(EpisodeSweepTest, WhatNeededNoFallbackIsTheSameWithoutTheLadder) {
  EpisodeSetting with_ladder = setting_;
  with_ladder.name = "with ladder";
  with_ladder.noise = "outside";
  EpisodeSetting taken_over = with_ladder;
  taken_over.name = "bare, taken over";
  taken_over.ladder = false;
  taken_over.bare_of = with_ladder.name;
  EpisodeSetting run = taken_over;
  run.name = "bare, run";
  run.bare_of.clear();
  EpisodeSetting easy = setting_;
  EpisodeSetting easy_bare = easy;
  easy_bare.name = "small bare";
  easy_bare.ladder = false;
  const ExperimentRequest request = Request(Folder("bare"));
  EpisodeSweep sweep("sweep", {with_ladder, taken_over, run, easy, easy_bare}, request);
  ASSERT_TRUE(sweep.Run());
  EXPECT_GT(StatisticsOf(sweep.Records(with_ladder)).ladder_used.successes, 0);
  EXPECT_EQ(WithoutTiming(sweep.Records(taken_over)), WithoutTiming(sweep.Records(run)));
  EXPECT_EQ(StatisticsOf(sweep.Records(run)).ladder_used.successes, 0);
  EXPECT_EQ(StatisticsOf(sweep.Records(easy)).ladder_used.successes, 0);
  EXPECT_EQ(WithoutTiming(sweep.Records(easy)), WithoutTiming(sweep.Records(easy_bare)));
}

TEST_F(EpisodeSweepTest, UnknownNoiseIsRefusedBeforeTheFirstEpisode) {
  const ExperimentRequest request = Request(Folder("noise"));
  EpisodeSetting unknown = setting_;
  unknown.noise = "earthquake";
  EpisodeSweep sweep("sweep", {setting_, unknown}, request);
  EXPECT_THROW(sweep.Run(), InputError);
  EXPECT_FALSE(fs::exists(request.out + "/sweep/small.jsonl"));
}

}  // namespace
}  // namespace feeler::evaluation
