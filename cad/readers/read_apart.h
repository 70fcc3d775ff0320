#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "feeler/cad/readers/read_part.h"

namespace feeler::cad {

/// Why a file is not read, and how to mend it.
struct Refusal {
  std::string what;
  std::string mend;
};

/// What `read` returns, run in a process of its own, for libraries that files can crash. Throws InputError for a
/// Refusal, for other exceptions of `read`, and where a signal ended it, naming the library; Interrupted.
RawPart ReadApart(const std::filesystem::path& file, const std::string& library, const std::function<RawPart()>& read);

}  // namespace feeler::cad
