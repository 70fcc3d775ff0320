#pragma once

#include <filesystem>
#include <string>

namespace feeler {

/// Where run-time data lies (models, the report's page, the paper's printed values): the first of these that is there
///   1. $FEELER_MODELS, for "models" alone; it is taken or refused, nothing else is tried
///   2. `name` in the folder given to SetDataFolder, in $FEELER_DATA_DIR
///   3. share/feeler/`name` beside the bin/ or lib/ folder of the program (or of the shared library that holds this
///      code): an installed tree may be moved
///   4. `name` in the source tree, for programs that lie in the build tree
///   5. share/feeler/`name` of the prefix that the library was configured for
/// Throws InputError that lists what it looked for if there is none.
std::filesystem::path FindData(const std::string& name);

/// Looks in `folder` first from now on: for a program that links the static libraries of a prefix and lies elsewhere
/// (CMake knows the folder as feeler_DATA_DIR). Call it before other threads use the library.
void SetDataFolder(const std::filesystem::path& folder);

}  // namespace feeler
