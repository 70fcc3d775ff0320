#pragma once

#include <memory>

#include "feeler/planner/contact/contact_map.h"

namespace feeler::planner {

/// The map with its dead ends filled: places of the tool (outside the target) from which at most one step leads on,
/// found again and again until none is left, count as blocked. That closes openings one cell wide, however deep, and
/// leaves surfaces as they are. Null if the map has no dead end.
///
/// A policy for the filled map needs no look into openings, and carries over to the map itself (see OpenPolicy).
std::shared_ptr<const ContactMap> FillDeadEnds(const ContactMap& map);

}  // namespace feeler::planner
