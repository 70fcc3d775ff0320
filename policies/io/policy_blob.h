#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "feeler/planner/policy/policy_graph.h"

namespace feeler::policies {

/// A policy as a short byte string (docs/file-formats.md gives the layout). About 5 bytes a node before and 3 after
/// deflation: numerators instead of probabilities and costs wherever those are fractions of the hypothesis count.
///
/// Laws: DecodePolicyBlob(EncodePolicyBlob(p)) equals p in every field, doubles bit for bit; equal policies give equal
/// blobs; any change of up to 32 neighbouring bits, hence any altered byte, is detected.

/// Throws std::invalid_argument if the policy breaks a law of FindPolicyFault: no such policy is ever stored.
std::string EncodePolicyBlob(const planner::PolicyGraph& policy);

/// Reads a blob of any origin; never trusts a number in it. `where` names the source in errors.
/// Throws InputError if it is cut off, altered, of an unknown version, or does not describe a lawful policy.
planner::PolicyGraph DecodePolicyBlob(std::string_view blob, const std::string& where);

}  // namespace feeler::policies
