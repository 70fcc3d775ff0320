#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "feeler/planner/motion/transfer_planner.h"

namespace feeler::planner {

/// RRT-Connect from `start` to any of `goals` over the validity and metric of `planner`, then short-cutting; at most
/// `iterations` iterations. Start and goals must be valid. Returns the way points, empty when none were found; all
/// random draws follow from `seed`.
std::vector<Eigen::VectorXd> SearchWay(const TransferPlanner& planner, const ValidityFunction& valid,
                                       const Eigen::VectorXd& start, const std::vector<Eigen::VectorXd>& goals,
                                       int iterations, std::uint64_t seed);

}  // namespace feeler::planner
