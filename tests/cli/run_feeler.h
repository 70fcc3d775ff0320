#pragma once

#include <functional>
#include <string>
#include <vector>

namespace feeler::cli {

/// A lattice problem in two dimensions, small.
inline const std::string kProblem = std::string(FEELER_SOURCE_DIR) + "/tests/data/slot2d.json";

struct CommandResult {
  int exit_code = -1;
  std::string out;
  std::string err;
};

/// Runs the feeler binary with these arguments, in a scratch folder of its own, with its cache under the test's folder.
CommandResult RunFeeler(const std::vector<std::string>& arguments);
/// The same after `in_child` has changed the process that becomes it: its descriptors, limits, signals.
CommandResult RunFeeler(const std::vector<std::string>& arguments, const std::function<void()>& in_child);

/// Starts the feeler binary, sends the signals `after_s` seconds later, a tenth of a second apart, and waits.
struct SignalledResult {
  CommandResult result;
  double ended_s = 0.0;  ///< after the first signal
};
SignalledResult SignalFeeler(const std::vector<std::string>& arguments, double after_s, const std::vector<int>& signals,
                             const std::function<void()>& in_child = {});

/// Starts the feeler binary and ends it without warning (SIGKILL) after a while, or lets it end by itself before.
/// Returns true if it was killed.
bool KillFeelerAfter(const std::vector<std::string>& arguments, double seconds);

/// A new empty folder under the test's temporary folder.
std::string ScratchFolder(const std::string& name);

/// The law of bad input: exit code 2, nothing on standard output, and one line on standard error, last, that names
/// `named` and ends with how to mend it, in brackets. Before it there may be what was noticed on the way.
void ExpectOneError(const CommandResult& result, const std::string& named);

std::string ReadFile(const std::string& path);
void WriteFile(const std::string& path, const std::string& content);

}  // namespace feeler::cli
