#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "feeler/core/file_output.h"
#include "feeler/env/vision/image.h"

namespace feeler::env {

struct VideoOptions {
  int width = 1280;  ///< even
  int height = 720;  ///< even
  int frames_per_second = 25;
  int quality = 20;  ///< constant rate factor of H.264: 0 lossless, 51 worst
};

/// Writes an MP4 (H.264, yuv420p: plays everywhere) through the program `ffmpeg`. Frames go to a temporary file beside
/// `path`; Finish renames it. A video that was not finished leaves nothing behind.
class VideoWriter {
 public:
  /// Throws InputError when ffmpeg is not installed, the path cannot be written, or an option makes no sense.
  VideoWriter(const std::string& path, const VideoOptions& options = {});
  ~VideoWriter();
  VideoWriter(const VideoWriter&) = delete;
  VideoWriter& operator=(const VideoWriter&) = delete;

  /// Adds a frame of the size of the options. Throws InputError for another size, or when ffmpeg has given up, with
  /// what it said.
  void Add(const Image& frame);
  /// Waits for the encoder and puts the file in its place. No frame may follow. Throws InputError when encoding failed
  /// or there was no frame.
  void Finish();

  std::int64_t frames() const { return frames_; }

 private:
  class Process;
  void Discard();

  std::string path_;
  VideoOptions options_;
  std::unique_ptr<OutputFile> output_;
  int buffer_ = -1;  // a file without a name, where the output cannot be gone back in; else -1
  std::unique_ptr<Process> process_;
  std::int64_t frames_ = 0;
};

}  // namespace feeler::env
