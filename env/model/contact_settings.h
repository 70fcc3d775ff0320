#pragma once

#include <map>
#include <string>
#include <vector>

#include "feeler/env/model/task_file.h"
#include "feeler/env/model/task_finding.h"

namespace feeler::env {

/// Settings of a task file that change where contact occurs, unseen by the contact map: margin and gap of geoms that
/// can collide, contype and conaffinity by which a geom of the tool passes through one of the target, contact pairs,
/// exclusions that concern tool or target, equality constraints. A task that plans and moves the same has none.
/// `where` names the file.
TaskFindings ContactSettingFindings(const TaskModel& task_model, const std::string& where);

/// How contact between tool and target feels, without moving where it is: friction, solref and solimp of their geoms
/// (least and most where they differ), masses of both, and a digest (32 bits) of all that physics takes from these
/// geoms and bodies. Two models of equal digest feel alike.
std::map<std::string, double> ContactParameters(const mjModel& model, const std::vector<int>& tool_geoms,
                                                const std::vector<int>& target_geoms, int tool_body, int target_body);

/// Contact parameters that no simulation means: friction below zero, time constants or stiffness of mixed sign,
/// impedances outside of 0 to 1. Throws InputError naming the geom.
void RequireSaneContactParameters(const mjModel& model, const std::string& where);

}  // namespace feeler::env
