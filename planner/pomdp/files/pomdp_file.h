#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "feeler/planner/pomdp/model/pomdp.h"

namespace feeler::planner {

/// Reads Cassandra's `.pomdp` format, all of its grammar (pomdp.org, "POMDP file grammar"): states, actions and
/// observations by number or name, `*`, `T:`, `O:` and `R:` as entries, rows and matrices, `uniform`, `identity`,
/// `reset`, `start` as a distribution, a state, `include` or `exclude`; later statements override earlier ones. A file
/// without observations is an MDP: the state is observed. `name` stands in errors. Throws InputError at `NAME:LINE`,
/// Interrupted where `stop` (asked now and then, may be empty) says so.
Pomdp ParseCassandraPomdp(std::string_view text, const std::string& name, const std::function<bool()>& stop = {});

/// Writes it. Reads back to the same model, up to the digits of a double.
std::string FormatCassandraPomdp(const Pomdp& pomdp);

/// Reads APPL's `.pomdpx` format, version 1.0: factored state, action and observation variables, tables (`TBL`, with
/// `*` and `-`, `uniform` and `identity`) and decision diagrams (`DD`, with `SubDAG`s and templates), rewards that add
/// up. The joint states are those that can be met from the initial belief. Throws InputError at `NAME:LINE`,
/// Interrupted where `stop` says so.
Pomdp ParsePomdpx(std::string_view text, const std::string& name, const std::function<bool()>& stop = {});

/// Writes it with one variable of each kind. Reads back to the same model where its names begin with a letter and are
/// free of blanks, but for states that cannot be met.
std::string FormatPomdpx(const Pomdp& pomdp);

/// Either, by the extension of the file. Throws InputError if it cannot be read, Interrupted where `stop` says so.
Pomdp ReadPomdp(const std::string& path, const std::function<bool()>& stop = {});

}  // namespace feeler::planner
