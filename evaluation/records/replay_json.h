#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "feeler/workflow/episode/episode_record.h"

namespace feeler::evaluation {

/// The `replay` of a record (docs/file-formats.md, "Replays"). The record has one.
nlohmann::ordered_json ReplayJson(const workflow::EpisodeRecord& record);

/// Base64 (RFC 4648) of bytes.
std::string Base64(std::span<const std::uint8_t> bytes);

/// Joint positions as steps of 2e-5 rad, each the zigzag varint of its difference to the sample before, joint by joint.
std::vector<std::uint8_t> PackJoints(const std::vector<env::JointVector>& q_rad);

/// Per hypothesis of the first attempt: 1 + index of the decision that ruled it out, 0 if none did.
std::vector<int> RuledOutBy(const execution::ExecutionRecord& execution, int hypotheses);
/// Run lengths: value and length, varints.
std::vector<std::uint8_t> PackRuns(const std::vector<int>& values);

}  // namespace feeler::evaluation
