#pragma once

#include <cstdint>
#include <vector>

namespace feeler::workflow {

/// A job on ranks as a discrete-event model knows it. What it leaves out: memory bandwidth that cores share, hosts of
/// different speed, ranks that start late.
struct JobModel {
  std::vector<double> piece_s;  ///< times of the pieces of work, in the order in which they are given out
  double start_s = 0.0;         ///< before a rank does its first piece: bound tables
  double commit_s = 0.0;        ///< rank 0 for a result, one after the other
  double message_s = 0.0;       ///< between a result and the next piece, where no piece is at hand
};

struct JobForecast {
  int ranks = 1;
  double wall_s = 0.0;
  double work_s = 0.0;        ///< sum of the pieces
  double efficiency = 1.0;    ///< work / (ranks * wall)
  double longest_s = 0.0;     ///< piece
  double committing_s = 0.0;  ///< rank 0 is busy with commits
};

/// Plays the job on so many ranks: each takes the next piece when it is free (ranks other than 0 have one more at hand
/// where there are many pieces, as Ranks::LanesFor has it), rank 0 commits results in the order in which they come.
/// Laws: wall >= start + work / ranks, start + longest, all commits; on one rank wall = start + work + commits. Ranks
/// at least 1.
JobForecast Simulate(const JobModel& model, int ranks);

}  // namespace feeler::workflow
