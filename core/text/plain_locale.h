#pragma once

#include <clocale>

namespace feeler {

/// While one lives, this thread reads and writes numbers with a point, whatever locale the program has set: by
/// setlocale (that of the thread gives way to "C") or as the global C++ locale, which streams take over when they are
/// made and the parsers of MJCF and URDF make their own (it is put back when the last of all threads ends). Nests.
class PlainLocale {
 public:
  PlainLocale();
  ~PlainLocale();
  PlainLocale(const PlainLocale&) = delete;
  PlainLocale& operator=(const PlainLocale&) = delete;

 private:
  locale_t plain_;
  locale_t before_;
};

}  // namespace feeler
