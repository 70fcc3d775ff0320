#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>

namespace feeler::cli {

/// A whole decimal number in least..most, all of `text` and nothing else (leading zeros allowed, no plus, no blanks).
/// Throws InputError naming the option.
std::int64_t ParseInteger(const std::string& option, const std::string& text, std::int64_t least, std::int64_t most);
std::uint64_t ParseUnsigned(const std::string& option, const std::string& text, std::uint64_t least,
                            std::uint64_t most);
/// A finite decimal number in least..most, all of `text`.
double ParseReal(const std::string& option, const std::string& text, double least, double most);

/// Numeric options: every one states its bounds, which stand in the help too. The value present is the default; it is
/// shown unless `show_default` is false (a value that means "not given").
CLI::Option* AddInteger(CLI::App& command, const std::string& name, int& value, int least, int most,
                        const std::string& help, bool show_default = true);
CLI::Option* AddInteger(CLI::App& command, const std::string& name, std::int64_t& value, std::int64_t least,
                        std::int64_t most, const std::string& help, bool show_default = true);
CLI::Option* AddReal(CLI::App& command, const std::string& name, double& value, double least, double most,
                     const std::string& help, bool show_default = true);
/// Any of the 2^64 seeds.
CLI::Option* AddSeed(CLI::App& command, std::uint64_t& value, const std::string& help);
/// --jobs, 1 to 1024.
CLI::Option* AddJobs(CLI::App& command, int& value, const std::string& help);

}  // namespace feeler::cli
