#pragma once

#include <string>
#include <string_view>

namespace feeler {

/// A file, pipe or device that a command writes to: the one writer of all outputs.
///
/// A regular file is written beside its place, as `PATH.part`, and takes its place whole at `Commit`: whatever happens
/// before, the old file stands. Symbolic links are followed. What is not a regular file (a device, a FIFO) and what is
/// a descriptor of this process (`/dev/stdout`, `/dev/fd/N`, `/proc/self/fd/N`) is written into as it is. A `.part`
/// that a killed process left behind is overwritten; one that a living process writes is refused.
class OutputFile {
 public:
  /// What becomes of the bytes so far, if there are any, when a signal ends the process before `Commit`. What is kept
  /// ends with a whole call of `Write`.
  enum class WhenInterrupted { kDiscard, kKeep };

  /// Opens it. Throws InputError.
  explicit OutputFile(const std::string& path, WhenInterrupted when_interrupted = WhenInterrupted::kDiscard);
  /// Discards what was not committed.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Hands the bytes over to the system at once: a process that is killed afterwards loses none of them. Throws
  /// InputError.
  void Write(std::string_view bytes);
  /// Syncs to the disk and puts the file in its place. Throws InputError.
  void Commit();

  /// What is written now: for another process (an encoder) to inherit and write to in place of `Write`. By its name it
  /// could not: whoever opens the part after a signal took it away makes it anew. -1 after Commit.
  int descriptor() const { return descriptor_; }
  /// True if there is nothing to replace: a device, a FIFO or a descriptor.
  bool direct() const { return part_.empty(); }

 private:
  void Open();
  [[noreturn]] void Fail(int error) const;

  std::string path_;    // as given, for messages
  std::string target_;  // links followed
  std::string part_;
  int descriptor_ = -1;
  int pending_ = -1;
  bool keep_ = false;
};

/// Replaces the file at `path` whole or not at all, or writes into what is not a regular file. Throws InputError.
void WriteFileAtomically(const std::string& path, std::string_view content);

/// True if writing to `path` replaces or makes a regular file.
bool IsReplaceable(const std::string& path);

/// True if both names lead to the same existing file (device and inode, links followed).
bool IsSameFile(const std::string& a, const std::string& b);

/// Ends what was begun, from a signal handler: files of WhenInterrupted::kKeep take their places, other parts go.
void SettleOutputsInSignalHandler() noexcept;

}  // namespace feeler
