#include "feeler/env/vision/video.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>
#include <vector>

#include "feeler/core/error.h"

namespace feeler::env {

// ffmpeg as a child process: frames into its standard input, the video into a descriptor that it inherits, its
// complaints kept in an unnamed file.
class VideoWriter::Process {
 public:
  static constexpr int kOutput = 3;  // descriptor of the child

  Process(std::vector<std::string> arguments, int output) {
    // A socket instead of a pipe: writing to a child that has died is then an error, not a signal to this process.
    int ends[2];
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) {
      throw InputError("video", std::string("no socket: ") + std::strerror(errno), "free some descriptors or memory");
    }
    input_ = ends[0];
    complaints_ = std::tmpfile();
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDIN_FILENO);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    if (complaints_ != nullptr) {
      posix_spawn_file_actions_adddup2(&actions, fileno(complaints_), STDERR_FILENO);
    } else {
      posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    }
    posix_spawn_file_actions_adddup2(&actions, output, kOutput);  // last: it may be one of those above
    // A group of its own: Ctrl-C is for us; we end the video.
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
    posix_spawnattr_setpgroup(&attributes, 0);
    std::vector<char*> argv;
    argv.reserve(arguments.size() + 1);
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    const int error = posix_spawnp(&child_, argv[0], &actions, &attributes, argv.data(), environ);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    if (error != 0) {
      child_ = -1;
      Close();
      throw InputError("video", fmt::format("cannot start '{}': {}", arguments[0], std::strerror(error)),
                       "install ffmpeg, or run without a video");
    }
  }

  ~Process() {
    if (child_ > 0) {
      kill(child_, SIGKILL);
      Wait();
    }
    Close();
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  // False when the child no longer listens.
  bool Write(const std::uint8_t* bytes, std::size_t count) const {
    while (count > 0) {
      const ssize_t sent = send(input_, bytes, count, MSG_NOSIGNAL);
      if (sent < 0 && errno == EINTR) continue;
      if (sent <= 0) return false;
      bytes += sent;
      count -= static_cast<std::size_t>(sent);
    }
    return true;
  }

  // End of input; true when the child ends well.
  bool Finish() {
    close(input_);
    input_ = -1;
    const int status = Wait();
    return WIFEXITED(status) && WEXITSTATUS(status) == 0;
  }

  // The last line that the child wrote to its standard error.
  std::string Complaint() const {
    if (complaints_ == nullptr) return "";
    std::rewind(complaints_);
    std::string last;
    std::array<char, 400> line{};
    while (std::fgets(line.data(), static_cast<int>(line.size()), complaints_) != nullptr) {
      std::string text(line.data());
      text.erase(std::find(text.begin(), text.end(), '\n'), text.end());
      if (!text.empty()) last = text;
    }
    return last;
  }

 private:
  int Wait() {
    int status = -1;
    while (waitpid(child_, &status, 0) < 0 && errno == EINTR) {
    }
    child_ = -1;
    return status;
  }
  void Close() {
    if (input_ >= 0) close(input_);
    input_ = -1;
    if (complaints_ != nullptr) std::fclose(complaints_);
    complaints_ = nullptr;
  }

  pid_t child_ = -1;
  int input_ = -1;
  std::FILE* complaints_ = nullptr;
};

namespace {

/// The descriptor of a new empty file without a name: however this process ends, nothing is left of it.
int UnnamedFile() {
  std::error_code error;
  std::filesystem::path folder = std::filesystem::temp_directory_path(error);
  if (error) folder = "/tmp";
  std::string name = (folder / "feeler-video-XXXXXX").string();
  const int descriptor = mkostemp(name.data(), O_CLOEXEC);
  if (descriptor < 0) {
    throw InputError(folder.string(), std::string("cannot write the video: ") + std::strerror(errno),
                     "set TMPDIR to a folder where you may write");
  }
  unlink(name.c_str());
  return descriptor;
}

}  // namespace

VideoWriter::VideoWriter(const std::string& path, const VideoOptions& options) : path_(path), options_(options) {
  if (options.width < 2 || options.height < 2 || options.width % 2 != 0 || options.height % 2 != 0 ||
      options.frames_per_second < 1 || options.quality < 0 || options.quality > 51) {
    throw InputError("video", "size, rate or quality out of range",
                     "even width and height, frames_per_second >= 1, quality 0 to 51");
  }
  // The place must be there before we render. What is not a regular file takes the video at the end: an encoder goes
  // back in what it writes.
  output_ = std::make_unique<OutputFile>(path);
  if (output_->direct()) buffer_ = UnnamedFile();
  try {
    process_ =
        std::make_unique<Process>(std::vector<std::string>{"ffmpeg",
                                                           "-hide_banner",
                                                           "-loglevel",
                                                           "error",
                                                           "-nostdin",
                                                           "-y",  //
                                                           "-f",
                                                           "rawvideo",
                                                           "-pix_fmt",
                                                           "rgb24",
                                                           "-s",
                                                           fmt::format("{}x{}", options.width, options.height),  //
                                                           "-r",
                                                           std::to_string(options.frames_per_second),
                                                           "-i",
                                                           "pipe:0",  //
                                                           "-an",
                                                           "-c:v",
                                                           "libx264",
                                                           "-preset",
                                                           "medium",
                                                           "-crf",
                                                           std::to_string(options.quality),  //
                                                           "-pix_fmt",
                                                           "yuv420p",
                                                           "-movflags",
                                                           "+faststart",
                                                           "-f",
                                                           "mp4",
                                                           fmt::format("file:/proc/self/fd/{}", Process::kOutput)},
                                  buffer_ >= 0 ? buffer_ : output_->descriptor());
  } catch (...) {
    Discard();
    throw;
  }
}

void VideoWriter::Discard() {
  if (buffer_ >= 0) close(std::exchange(buffer_, -1));
  output_.reset();  // takes its part away
}

VideoWriter::~VideoWriter() {
  process_.reset();
  Discard();
}

void VideoWriter::Add(const Image& frame) {
  if (!process_) throw InputError("video", "a frame after the end", "add frames before Finish");
  if (frame.width != options_.width || frame.height != options_.height ||
      frame.rgb.size() != 3 * static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height)) {
    throw InputError("video", "a frame of another size", "render at the size of the video");
  }
  if (!process_->Write(frame.rgb.data(), frame.rgb.size())) {
    throw InputError(path_, "ffmpeg stopped: " + process_->Complaint(), "check disk space and the ffmpeg installation");
  }
  ++frames_;
}

void VideoWriter::Finish() {
  if (!process_) return;
  const bool good = process_->Finish();
  const std::string complaint = process_->Complaint();
  process_.reset();
  if (!good || frames_ == 0) {
    Discard();
    throw InputError(path_, frames_ == 0 ? "a video without frames" : "the video was not written: " + complaint,
                     "check disk space and the ffmpeg installation");
  }
  if (buffer_ >= 0) {
    std::vector<char> chunk(1 << 16);
    off_t at = 0;
    while (true) {
      const ssize_t count = pread(buffer_, chunk.data(), chunk.size(), at);
      if (count < 0 && errno == EINTR) continue;
      if (count < 0) throw InputError(path_, std::string("the video was lost: ") + std::strerror(errno), "try again");
      if (count == 0) break;
      output_->Write({chunk.data(), static_cast<std::size_t>(count)});
      at += count;
    }
    close(std::exchange(buffer_, -1));
  }
  output_->Commit();
}

}  // namespace feeler::env
