#pragma once

#include <string>
#include <string_view>

#include "feeler/planner/belief/lattice_problem.h"

namespace feeler::policies {

/// Reads a lattice problem file (docs/file-formats.md). Throws InputError naming file and field: unreadable or cut-off
/// JSON, unknown or missing keys, lists of a wrong length, numbers that are not whole or out of range, no cells, no
/// hypotheses or one twice, weights that are not positive, a start outside or blocked, more than 2^26 displacements.
planner::LatticeProblemData ReadLatticeProblem(const std::string& path);
/// The same from text; `where` stands for the file in errors.
planner::LatticeProblemData ParseLatticeProblem(std::string_view text, const std::string& where);

/// The text of a lattice problem file. Law: parsing it gives the data back, weights and costs bit for bit.
std::string FormatLatticeProblem(const planner::LatticeProblemData& data);

}  // namespace feeler::policies
