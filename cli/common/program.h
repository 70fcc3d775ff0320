#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

#include "feeler/cli/common/session.h"
#include "feeler/core/progress.h"

namespace feeler::cli {

/// What a program of ours begins with: open streams, signals that cancel, and one line for whatever ends it.
void BeginProgram(CancellationToken& cancellation);

/// Who is told of an error instead of standard error (another process of the same job): called with the message and the
/// exit code; the program then ends with 0. Empty: nobody.
void TellErrorsTo(std::function<void(const std::string& message, int code)> listener);

/// The exception at hand as one line and an exit code.
int ExplainException();

/// Parses the arguments and runs what they ask for. Whatever goes wrong becomes one line on standard error. Returns the
/// exit code: 0 done, 1 ran and the answer is no, 2 bad usage or input.
int RunProgram(CLI::App& app, const Session& session, int argc, char** argv);

}  // namespace feeler::cli
