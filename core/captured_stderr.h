#pragma once

#include <string>

namespace feeler {

/// What a library that knows no other way writes to standard error (libpng, libjpeg), kept from the terminal for the
/// life of this object. The descriptor belongs to the whole process: one object at a time (others wait), and for short
/// calls only. Where there is no room for it, nothing is captured.
class CapturedStderr {
 public:
  CapturedStderr();
  ~CapturedStderr();
  CapturedStderr(const CapturedStderr&) = delete;
  CapturedStderr& operator=(const CapturedStderr&) = delete;

  /// The last line written so far; empty if there is none.
  std::string LastLine() const;

 private:
  int before_ = -1;   // the true standard error
  int capture_ = -1;  // an unnamed file
};

}  // namespace feeler
