#pragma once

#include <string>
#include <string_view>

#include "feeler/planner/pomdp/model/controller.h"
#include "feeler/planner/pomdp/model/pomdp.h"

namespace feeler::policies {

/// The policy of a general POMDP as a graph, which may be cyclic (docs/pomdp.md): `{"pomdp", "value", "root", "nodes":
/// [{"action": name, "next": {observation: node, ...}, "otherwise": node}, ...]}`.
std::string FormatController(const planner::Pomdp& pomdp, const planner::PomdpController& controller, double value);

/// Reads it back. Throws InputError naming `where` and the field if it is none, or does not belong to the model.
planner::PomdpController ParseController(std::string_view text, const std::string& where, const planner::Pomdp& pomdp);

}  // namespace feeler::policies
