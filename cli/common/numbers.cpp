#include "feeler/cli/common/numbers.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <limits>
#include <system_error>

#include "feeler/core/error.h"

namespace feeler::cli {
namespace {

constexpr int kMostJobs = 1024;

template <class Number>
Number Parse(const std::string& option, const std::string& text, Number least, Number most) {
  const std::string range = fmt::format("give a number from {} to {}", least, most);
  Number value{};
  const char* end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, value);
  if (text.empty()) throw InputError(option, "an empty text is not a number", range);
  const bool whole_text = rest == end;
  if (error == std::errc::invalid_argument || !whole_text) {
    const bool negative = std::is_unsigned_v<Number> && text.front() == '-';
    const char* kind = std::is_integral_v<Number> ? "whole number" : "number";
    throw InputError(option, negative ? text + " is negative" : fmt::format("\"{}\" is not a {}", text, kind), range);
  }
  if (error == std::errc::result_out_of_range || !(value >= least && value <= most)) {
    throw InputError(option, text + " is out of range", range);
  }
  return value;
}

template <class Number, class Parser>
CLI::Option* Add(CLI::App& command, const std::string& name, Number& value, const std::string& help, bool show_default,
                 const Parser& parse) {
  const auto read = [&value, name, parse](const CLI::results_t& results) {
    value = parse(name, results.back());
    return true;
  };
  const auto shown = [&value] { return fmt::format("{}", value); };
  CLI::Option* option = command.add_option(name, read, help, show_default, shown);
  option->type_name("NUMBER");
  if (show_default) option->capture_default_str();
  return option;
}

}  // namespace

std::int64_t ParseInteger(const std::string& option, const std::string& text, std::int64_t least, std::int64_t most) {
  return Parse(option, text, least, most);
}

std::uint64_t ParseUnsigned(const std::string& option, const std::string& text, std::uint64_t least,
                            std::uint64_t most) {
  return Parse(option, text, least, most);
}

double ParseReal(const std::string& option, const std::string& text, double least, double most) {
  return Parse(option, text, least, most);
}

CLI::Option* AddInteger(CLI::App& command, const std::string& name, int& value, int least, int most,
                        const std::string& help, bool show_default) {
  return Add(command, name, value, fmt::format("{} ({}..{})", help, least, most), show_default,
             [least, most](const std::string& option, const std::string& text) {
               return static_cast<int>(ParseInteger(option, text, least, most));
             });
}

CLI::Option* AddInteger(CLI::App& command, const std::string& name, std::int64_t& value, std::int64_t least,
                        std::int64_t most, const std::string& help, bool show_default) {
  return Add(command, name, value, fmt::format("{} ({}..{})", help, least, most), show_default,
             [least, most](const std::string& option, const std::string& text) {
               return ParseInteger(option, text, least, most);
             });
}

CLI::Option* AddReal(CLI::App& command, const std::string& name, double& value, double least, double most,
                     const std::string& help, bool show_default) {
  return Add(command, name, value, fmt::format("{} ({:g}..{:g})", help, least, most), show_default,
             [least, most](const std::string& option, const std::string& text) {
               return ParseReal(option, text, least, most);
             });
}

CLI::Option* AddSeed(CLI::App& command, std::uint64_t& value, const std::string& help) {
  constexpr std::uint64_t kMost = std::numeric_limits<std::uint64_t>::max();
  return Add(command, "--seed", value, help + " (0..2^64-1)", true,
             [](const std::string& option, const std::string& text) { return ParseUnsigned(option, text, 0, kMost); });
}

CLI::Option* AddJobs(CLI::App& command, int& value, const std::string& help) {
  return AddInteger(command, "--jobs", value, 1, kMostJobs, help);
}

}  // namespace feeler::cli
