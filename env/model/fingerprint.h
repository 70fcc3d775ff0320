#pragma once

#include <string>

#include "feeler/env/model/task_file.h"

namespace feeler::env {

/// 128 bits, as 32 hexadecimal digits, of all that a policy database depends on: the geometry that can collide and the
/// lids (rounded to 1e-9 m), axes, lattice, start, workspace, move lengths, costs, goal, opening. Names, colours,
/// visual geoms, comments and the placement of the task in the world do not count.
std::string Fingerprint(const TaskModel& task_model, Opening opening);

/// Of the contact map alone: geometry, lattice and opening; the cache's key.
std::string ContactMapFingerprint(const TaskModel& task_model, Opening opening);

}  // namespace feeler::env
