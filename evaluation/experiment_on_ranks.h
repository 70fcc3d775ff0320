#pragma once

#include "feeler/evaluation/registry.h"
#include "feeler/workflow/scale/ranks.h"

namespace feeler::evaluation {

/// RunExperiment by all ranks: as many shards as there are ranks, each measured into OUT/ranks/I-of-N on the host of
/// its rank, their cells and records collected by rank 0, which goes on from them as from request.from. Rank 0 returns
/// the outcome, after which OUT/ranks is gone from its host; interrupted, the folders stay, and the same command goes
/// on. Other ranks serve and return nothing of use. Law: table and records are those of RunExperiment, but for measured
/// times. Throws InputError for an experiment that takes no shards, and for a request with shard or from.
ExperimentOutcome RunExperimentOnRanks(const Experiment& experiment, const ExperimentRequest& request,
                                       workflow::Ranks& ranks);

}  // namespace feeler::evaluation
