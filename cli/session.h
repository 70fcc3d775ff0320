#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "feeler/core/progress.h"

namespace feeler::cli {

/// What every subcommand shares: the Ctrl-C token and the exit code it leaves (0 done, 1 the answer is no).
struct Session {
  CancellationToken* cancellation = nullptr;
  int exit_code = 0;
};

/// Prints a result for machines: one JSON document on stdout.
void PrintJson(const nlohmann::json& value);

/// Fails with an InputError unless a file can be created or replaced at `path` (checked before long work begins).
void RequireWritable(const std::string& option, const std::string& path);

}  // namespace feeler::cli
