#include "feeler/cli/common/outputs.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <system_error>

#include "feeler/core/error.h"
#include "feeler/core/file_output.h"

namespace feeler::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kHeadBytes = 4096;

std::string HeadOf(const std::string& path) {
  std::string head(kHeadBytes, '\0');
  std::ifstream in(path, std::ios::binary);
  in.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(std::max<std::streamsize>(0, in.gcount())));
  return head;
}

bool HoldsAll(std::string_view head, std::initializer_list<std::string_view> words) {
  return std::all_of(words.begin(), words.end(),
                     [&](std::string_view word) { return head.find(word) != std::string_view::npos; });
}

bool IsPage(std::string_view head, std::string_view mark) {
  std::string begin(head.substr(0, 15));
  std::transform(begin.begin(), begin.end(), begin.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return begin == "<!doctype html>" && HoldsAll(head, {mark});
}

struct Kind {
  const char* name;
  bool (*recognises)(std::string_view head);
};

/// By what our own writers begin with; the order is that of FileKind.
constexpr std::array<Kind, 17> kKinds{{
    {"a policy file",
     [](std::string_view h) {
       return h.starts_with('{') && HoldsAll(h, {"\"task\"", "\"start\"", "\"expected_cost\""});
     }},
    {"an uncertainty table",
     [](std::string_view h) {
       return h.starts_with('{') && HoldsAll(h, {"\"kind\"", "\"version\"", "\"fingerprint\""});
     }},
    {"a file of records",
     [](std::string_view h) {
       return h.starts_with('{') && HoldsAll(h, {"\"seed\""}) &&
              (HoldsAll(h, {"\"task\"", "\"policy\""}) || HoldsAll(h, {"\"assembly\""}));
     }},
    {"a report", [](std::string_view h) { return IsPage(h, "<title>Feeler report"); }},
    {"a Graphviz drawing", [](std::string_view h) { return h.starts_with("digraph"); }},
    {"a page with a drawing", [](std::string_view h) { return IsPage(h, "<style>"); }},
    {"a .pomdp file",
     [](std::string_view h) {
       return HoldsAll(h, {"discount:", "values:"});
     }},
    {"a .pomdpx file", [](std::string_view h) { return HoldsAll(h, {"<pomdpx"}); }},
    {"a PNG picture", [](std::string_view h) { return h.starts_with("\x89PNG\r\n\x1a\n"); }},
    {"an MP4 video", [](std::string_view h) { return h.substr(0, 8).ends_with("ftyp"); }},
    {"a Feeler database", [](std::string_view h) { return h.starts_with("SQLite format 3"); }},
    {"a result of an experiment",
     [](std::string_view h) { return h.starts_with('{') && HoldsAll(h, {"\"columns\""}); }},
    {"a manifest of an experiment",
     [](std::string_view h) { return h.starts_with('{') && HoldsAll(h, {"\"command\""}); }},
    {"a scene of a report",
     [](std::string_view h) {
       return h.starts_with('{') && HoldsAll(h, {"\"task\"", "\"bodies\""});
     }},
    {"a policy of a POMDP",
     [](std::string_view h) {
       const bool alpha = !h.empty() && (std::isdigit(static_cast<unsigned char>(h.front())) != 0 || h.front() == '#');
       return alpha || HoldsAll(h, {"<Policy"}) || (h.starts_with('{') && HoldsAll(h, {"\"nodes\""}));
     }},
    {"a cell file", [](std::string_view h) { return h.starts_with('{') && HoldsAll(h, {"\"feeler cell\""}); }},
    {"a part of pipes",
     [](std::string_view h) { return h.starts_with("<mujoco") && HoldsAll(h, {"make-pipe-parts"}); }},
}};

InputError CannotWrite(const Output& output, int error) {
  return {output.option, "cannot write " + output.path + ": " + std::generic_category().message(error),
          error == ENOENT ? "create the folder first" : "choose a place where you may write"};
}

/// That a file can be made or replaced there: asked of the system, without touching anything.
void RequirePlace(const Output& output) {
  struct stat status {};
  if (stat(output.path.c_str(), &status) == 0) {
    if (S_ISDIR(status.st_mode))
      throw InputError(output.option, output.path + " is a directory", "give a file to write");
    if (output.kind == FileKind::kDatabase && !S_ISREG(status.st_mode)) {
      throw InputError(output.option, output.path + " is not a regular file, which a database must be",
                       "give the name of a file");
    }
    if (access(output.path.c_str(), W_OK) != 0) throw CannotWrite(output, errno);
    if (!IsReplaceable(output.path)) return;
  } else if (errno != ENOENT) {
    throw CannotWrite(output, errno);
  }
  fs::path target(output.path);
  std::error_code error;
  for (int links = 0; fs::is_symlink(fs::symlink_status(target, error)) && links < 40; ++links) {
    target = target.parent_path() / fs::read_symlink(target, error);
  }
  const std::string folder = target.has_parent_path() ? target.parent_path().string() : ".";
  if (stat(folder.c_str(), &status) != 0) {
    const int reason = errno;
    if (reason != ENOENT) throw CannotWrite(output, reason);
    throw InputError(output.option, "the folder " + folder + " does not exist", "create it first");
  }
  if (!S_ISDIR(status.st_mode)) throw CannotWrite(output, ENOTDIR);
  if (access(folder.c_str(), W_OK | X_OK) != 0) throw CannotWrite(output, errno);
}

void RequireOwnKind(const Output& output) {
  struct stat status {};
  if (stat(output.path.c_str(), &status) != 0 || !S_ISREG(status.st_mode) || status.st_size == 0) return;
  if (!IsReplaceable(output.path)) return;  // a descriptor: whoever opened it knows what it is
  const Kind& kind = kKinds[static_cast<std::size_t>(output.kind)];
  if (kind.recognises(HeadOf(output.path))) return;
  throw InputError(output.option, output.path + " exists and is not " + kind.name + ": it is not overwritten",
                   "choose another name");
}

}  // namespace

void RequireOutputs(const std::vector<Output>& outputs, const std::vector<std::string>& inputs) {
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const Output& output = outputs[i];
    if (output.path.empty()) continue;
    for (const std::string& input : inputs) {
      if (!input.empty() && IsReplaceable(output.path) && IsSameFile(output.path, input)) {
        throw InputError(output.option, output.path + " is the same file as the input " + input, "choose another name");
      }
    }
    for (std::size_t k = 0; k < i; ++k) {
      const std::string& other = outputs[k].path;
      const bool same =
          !other.empty() && (fs::path(other).lexically_normal() == fs::path(output.path).lexically_normal() ||
                             IsSameFile(other, output.path));
      if (same && IsReplaceable(output.path)) {
        throw InputError(output.option, output.path + " is written as " + outputs[k].option + " too",
                         "choose another name for one");
      }
    }
    RequirePlace(output);
    RequireOwnKind(output);
  }
}

}  // namespace feeler::cli
