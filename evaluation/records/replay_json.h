#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "feeler/execution/records/episode_line.h"
#include "feeler/workflow/episode/episode_record.h"

namespace feeler::evaluation {

/// What a robot knows of the `replay` of a record (docs/file-formats.md, "Replays"); the executor's decisions are added
/// where the record is written (execution/records).
nlohmann::ordered_json RobotReplay(const workflow::Replay& replay);

/// Base64 (RFC 4648) of bytes.
std::string Base64(std::span<const std::uint8_t> bytes);

/// Joint positions as steps of 2e-5 rad, each the zigzag varint of its difference to the sample before, joint by joint.
std::vector<std::uint8_t> PackJoints(const std::vector<env::JointVector>& q_rad);

using execution::PackRuns;
using execution::RuledOutBy;

}  // namespace feeler::evaluation
