#pragma once

#include <limits>
#include <string>

#include "feeler/planner/policy/expand_policy.h"

namespace feeler::policies {

/// How much of a policy is drawn. What is cut off stands as one node that says how many hypotheses and what cost
/// remain.
struct PolicyDrawingOptions {
  int max_depth = std::numeric_limits<int>::max();  ///< moves from the root; >= 0
  double min_probability = 0.0;                     ///< of reaching a node, in [0, 1]; rarer ones are cut
};

/// Graphviz: `dot -Tsvg`. Throws InputError if an option is out of range.
std::string FormatPolicyDot(const planner::ExpandedPolicy& policy, const std::string& title,
                            const PolicyDrawingOptions& options = {});

/// One self-contained page (SVG within, no script needed, nothing loaded): the tree from left to right, edges as thick
/// as they are probable, details on hovering. Same errors.
std::string FormatPolicyHtml(const planner::ExpandedPolicy& policy, const std::string& title,
                             const PolicyDrawingOptions& options = {});

}  // namespace feeler::policies
