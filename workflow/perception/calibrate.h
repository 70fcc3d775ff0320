#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "feeler/core/parallelism.h"
#include "feeler/core/progress.h"
#include "feeler/env/model/task_file.h"
#include "feeler/env/vision/depth_noise.h"
#include "feeler/perception/uncertainty_table.h"
#include "feeler/workflow/perception/known_negatives.h"
#include "feeler/workflow/perception/perceive.h"
#include "feeler/workflow/scale/ranks.h"
#include "feeler/workflow/scale/shard.h"

namespace feeler::workflow {

struct CalibrationOptions {
  int poses = 1000;       ///< to make the table from; as many others to judge it by
  int installations = 5;  ///< of the camera, to make the table from; as many others to judge it by
  std::uint64_t seed = 1;
  env::DepthNoiseOptions noise;
  PerceptionSettings perception;
  perception::TableOptions table;
  Parallelism jobs;
  std::string
      partial;  ///< file that keeps finished poses; a run that finds one of the same settings goes on; empty: none
  std::optional<Shard> shard;     ///< take only the poses of it: the calibration is then never complete
  std::vector<std::string> from;  ///< partial files of shards, of the same settings, to go on from
  Ranks* ranks = nullptr;         ///< take poses too (ServeCalibration); may be null
  ProgressCallback progress;
  const CancellationToken* cancellation = nullptr;
  void Validate() const;  ///< throws InputError
};

/// One pose of a calibration.
struct CalibrationSample {
  std::int64_t index = 0;
  bool held_out = false;
  int installation = 0;
  bool found = false;
  double distance_m = 0.0;
  perception::MatchEvidence evidence;
  double cpu_s = 0.0;
  int rejected = 0;
  perception::PoseSample poses;  ///< the estimate only if found
};

struct Calibration {
  bool complete = false;
  std::vector<CalibrationSample> samples;  ///< in order of index
  perception::UncertaintyTable table;
  perception::TableScore made_from, held_out, held_out_plain;
  int not_found = 0;
  std::vector<KnownNegative> negatives;  ///< what is not the target, and whether it is taken for it
};

/// Photographs the target at places drawn over the workspace, by cameras of several installations, registers it, and
/// makes the uncertainty table from what estimates and truth differ by. One half of poses and installations makes the
/// table, the other judges it. Sample k is drawn from (seed, k): the same at any number of threads. A target that is
/// not found makes no rule; it counts in `not_found`.
/// Beside the poses, known negatives are shown to the finder.
/// A shard leaves its poses in `partial`. Throws InputError for a file of `from` that is of other settings, or holds a
/// pose that another holds too, or none.
Calibration Calibrate(const env::TaskModel& task_model, const CalibrationOptions& options);

/// Removes the file of finished poses: to be called once the table that is made from them is kept.
void RemovePartial(const CalibrationOptions& options);

/// On a rank that works for another: takes the poses that it asks for.
void ServeCalibration(const env::TaskModel& task_model, const CalibrationOptions& options);

/// Errors of estimates, one of each kind per sample that was found, held-out ones only.
struct ErrorSummary {
  double along_p95_m = 0.0;     ///< along the view
  double across_p95_m = 0.0;    ///< across it, horizontal
  double vertical_p95_m = 0.0;  ///< square to both
  double yaw_p95_rad = 0.0;     ///< angle between the orientations
  double largest_m = 0.0;
  int gross = 0;  ///< above 30 mm
  int samples = 0;
};
/// Of the estimates as they are, or, with `correct`, with the bias of the table taken out.
ErrorSummary SummarizeErrors(const Calibration& calibration, bool correct);

/// "known negatives: 0 of 14 are taken for the target (3 plates, 3 boxes, 8 parts of other tasks)", and which.
std::string NegativesLine(const std::vector<KnownNegative>& negatives);

/// What `feeler perceive calibrate` and the table's own report say of it.
std::string ReportJson(const Calibration& calibration, const CalibrationOptions& options);

}  // namespace feeler::workflow
