#pragma once

#include <string>
#include <vector>

namespace feeler::cli {

/// What a command writes. An existing file is replaced by one of its own kind only.
enum class FileKind {
  kPolicy,
  kTable,
  kRecords,
  kReport,
  kGraphDot,
  kGraphHtml,
  kPomdp,
  kPomdpx,
  kPng,
  kMp4,
  kDatabase,
  kExperiment,
  kManifest,
  kScene,
  kPomdpPolicy,  ///< .json, .alpha or .policyx
  kCell,
  kPipePart
};

struct Output {
  std::string option;  ///< "--out"
  std::string path;
  FileKind kind;
};

/// Checks before anything is opened and before long work begins that each output
/// - can be made, replaced or written into;
/// - is not the same file (device and inode, links followed) as an input or as another output;
/// - replaces nothing but an empty file or one of its kind.
/// Outputs and inputs with an empty path are left out. Throws InputError naming the option.
void RequireOutputs(const std::vector<Output>& outputs, const std::vector<std::string>& inputs);

/// The files that a task is read from: itself, what it includes, meshes and textures. Its own file alone where
/// that cannot be read: the loader will say why.
std::vector<std::string> InputsOfTask(const std::string& task);

}  // namespace feeler::cli
