#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "feeler/evaluation/records/episode_json.h"
#include "feeler/workflow/scale/shard.h"

namespace feeler::evaluation {

/// What a records file of a shard holds, said in a file beside it, so that the records are those of a whole run.
struct RecordsShard {
  workflow::Shard shard;
  std::int64_t episodes = 0;  ///< of all shards, numbered from 0
  nlohmann::json settings;    ///< everything that shapes the records
};

/// "RECORDS.shard.json".
std::string ShardFileOf(const std::string& records);
void WriteRecordsShard(const std::string& records, const RecordsShard& shard);
/// Throws InputError if it is missing or damaged.
RecordsShard ReadRecordsShard(const std::string& records);

/// Puts the records of all shards of a run together, in order of episode, the lines as they are.
///
/// Law: `out` is what the run without --shard writes, byte for byte but for the measured times. It appears whole or not
/// at all. Throws InputError for fewer than two files; a file that is given twice, damaged, unfinished, or no shard;
/// shards of different runs; one that is there twice or missing; an `out` that exists. Returns the rows of all.
std::vector<EpisodeSummaryRow> MergeRecords(const std::vector<std::string>& files, const std::string& out);

}  // namespace feeler::evaluation
