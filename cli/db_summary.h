#pragma once

#include <nlohmann/json.hpp>

#include "feeler/policies/storage/database.h"

namespace feeler::cli {

/// Keys: problems, solved, ratio_mean, ratio_max, expected_cost_mean, cpu_s, wall_s, bytes, policy_nodes, statuses,
/// ratios.
nlohmann::json InfoJson(const policies::DatabaseInfo& info);
/// The same for people, with the distribution of certified ratios, on stdout.
/// `unit` of the costs: workflow::CostUnit.
void PrintInfo(const policies::DatabaseInfo& info, const std::string& unit);

}  // namespace feeler::cli
