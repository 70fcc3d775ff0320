#pragma once

#include <cstdint>
#include <string>

#include "core/progress.h"
#include "workflow/episode.h"

namespace feeler::workflow {

/// Runs an episode once more and films it: an MP4 of 1280 x 720 pixels (the arm and, beside it, the connector from
/// near), 25 frames a simulated second. Throws InputError if the file cannot be written or the machine cannot render or
/// encode.
EpisodeRecord RecordEpisodeVideo(EpisodeRunner& runner, std::uint64_t episode, const std::string& path,
                                 const ProgressCallback& progress);

}  // namespace feeler::workflow
