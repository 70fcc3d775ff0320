#pragma once

#include <vector>

#include "feeler/core/task.h"
#include "feeler/planner/family/problem_family.h"

namespace feeler::planner {

/// Weighs the hypotheses of MakeCuboidProblem(task, map, extents): normally distributed about the estimate, axis by
/// axis, each hypothesis with the mass of the cell around it, and a twentieth spread evenly, so that no policy neglects
/// what a calibration never met. `deviation`: standard deviation along each uncertain axis of the task, in its order, m
/// or rad; empty: the weights stay as they are, equal. Throws InputError unless there is a positive one for each axis.
void WeighByPrior(const Task& task, const std::vector<double>& deviation, const Extents& extents, Problem& problem);

}  // namespace feeler::planner
