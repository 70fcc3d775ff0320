#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "feeler/planner/pomdp/model/full_alpha_vector.h"
#include "feeler/planner/pomdp/model/pomdp.h"

namespace feeler::planner {

/// Alpha vectors as pomdp-solve writes and reads them (`.alpha`): for each the number of its action, a line of one
/// value a state, an empty line. Throws InputError if the text would exceed 400 MB.
std::string FormatAlpha(const Pomdp& pomdp, const std::vector<FullAlphaVector>& alphas);
/// APPL's `.policyx`, of a model whose states are all hidden: one observed value, vectors over all states. Same error.
std::string FormatPolicyx(const Pomdp& pomdp, const std::vector<FullAlphaVector>& alphas);

/// Read them back. `name` stands in errors; throws InputError at `NAME:LINE` if they do not belong to the model.
std::vector<FullAlphaVector> ParseAlpha(std::string_view text, const std::string& name, const Pomdp& pomdp);
std::vector<FullAlphaVector> ParsePolicyx(std::string_view text, const std::string& name, const Pomdp& pomdp);

}  // namespace feeler::planner
