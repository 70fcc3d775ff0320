#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "feeler/core/progress.h"
#include "feeler/env/arm/ur10e.h"
#include "feeler/env/scene/scene.h"
#include "feeler/workflow/episode/episode.h"

namespace feeler::workflow {

/// An episode as a camera needs it: where everything stood, 25 times a simulated second.
struct EpisodeFilm {
  struct Frame {
    double time_s = 0.0;
    env::JointVector q_rad = env::JointVector::Zero();
    Pose world_T_target = Pose::Identity();
  };
  std::string label;  ///< shown in the picture
  std::shared_ptr<const env::Scene> scene;
  std::vector<Frame> frames;
  EpisodeRecord record;
};

/// Runs an episode once more and keeps what is to be seen.
EpisodeFilm FilmEpisode(EpisodeRunner& runner, std::uint64_t episode, std::string label);

/// What stands in the picture beside the name of the policy at a moment: the clock, at the end the verdict.
std::string Caption(const EpisodeFilm& film, std::size_t frame);

/// An MP4 of 1280 x 720 pixels at 25 frames a simulated second. One film: the arm and, beside it, the connector from
/// near. Two: side by side, the connector from near with the arm in a corner; the shorter one waits at its end for the
/// other. Throws InputError if the file cannot be written or the machine cannot render or encode.
void WriteVideo(const std::vector<EpisodeFilm>& films, const std::string& path, const ProgressCallback& progress);

/// Both at once for one episode.
EpisodeRecord RecordEpisodeVideo(EpisodeRunner& runner, std::uint64_t episode, const std::string& path,
                                 const ProgressCallback& progress);

}  // namespace feeler::workflow
