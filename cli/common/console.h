#pragma once

#include <fmt/format.h>

#include <string_view>
#include <utility>

namespace feeler::cli {

/// Opens descriptors 0 to 2 on /dev/null where they are closed, before a file that is opened can take their numbers.
/// What is written to a standard output that was closed counts as lost.
void OpenClosedStreams();

/// A result, to standard output. Never throws; what cannot be written is remembered (ResultsLost).
void PrintResult(std::string_view text);
/// What a person wants to know meanwhile, to standard error. Never throws; what cannot be written is dropped.
void Tell(std::string_view text);

/// From now on nothing is printed or told: another process of the same job does.
void Mute();

template <class... Arguments>
void Print(fmt::format_string<Arguments...> format, Arguments&&... arguments) {
  PrintResult(fmt::format(format, std::forward<Arguments>(arguments)...));
}
template <class... Arguments>
void Note(fmt::format_string<Arguments...> format, Arguments&&... arguments) {
  Tell(fmt::format(format, std::forward<Arguments>(arguments)...));
}

/// Hands over what is still held back; then the reason why results were lost, or empty.
std::string_view ResultsLost();

}  // namespace feeler::cli
