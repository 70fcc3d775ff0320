#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace feeler::fuzz {

/// A reader under test: what it makes of any bytes is a value or a feeler::Error, nothing else.
struct Reader {
  const char* name;
  void (*read)(std::string_view bytes);
  /// Most of the work is another library's (MuJoCo and tinyxml2, SQLite, assimp): what crashes there is counted apart.
  bool third_party = false;
};

/// Those that link no simulator: core, planner, policies, perception, execution.
std::span<const Reader> Readers();
/// The others: task files, databases and bundles, CAD meshes, records, cells, robots, assemblies.
std::span<const Reader> MoreReaders();

/// Sound inputs of a reader, made by our own writers or by hand.
std::vector<std::string> Seeds(const Reader& reader);
std::vector<std::string> MoreSeeds(const Reader& reader);

/// A small model in Cassandra's format.
std::string TigerText();

/// Runs a reader. Returns false if it refused the bytes (feeler::Error). Anything else that it throws leaves, and so
/// does a refusal that is not one printable line with a way to mend it (std::logic_error).
bool ReadOnce(const Reader& reader, std::string_view bytes);

}  // namespace feeler::fuzz
