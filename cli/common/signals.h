#pragma once

#include <string_view>

#include "feeler/core/progress.h"

namespace feeler::cli {

/// From now on SIGINT, SIGTERM and SIGHUP cancel `cancellation`. Work that has not ended 1.5 s later is ended: outputs
/// that are whole up to here take their places (OutputFile), the exit code is 1. A second signal ends at once. A SIGHUP
/// that was ignored at the start stays ignored; SIGPIPE is ignored: writing fails instead. Call once.
void CancelOnSignals(CancellationToken& cancellation);
/// The command at work has something that is kept when a signal ends it: said where it does. Until then nothing is.
void KeepsWhatIsDone();
/// What is said when a signal has ended a command, a line.
std::string_view InterruptedMessage();
/// What a signal ends is ended without a word: another process of the same job tells.
void EndSilently();

}  // namespace feeler::cli
