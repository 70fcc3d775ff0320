#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "feeler/core/progress.h"

namespace feeler::policies {

struct MergeSummary {
  std::int64_t problems = 0;
  int files = 0;
  std::string digest;  ///< ContentDigest of the new file
};

/// Puts databases together that hold parts of one family: the shards of it, every one, or files of disjoint families.
///
/// Law: the content digest of `out` is that of the database of the whole family made in one go. `out` appears whole or
/// not at all; the bundle of the first part that has one is copied beside it. Throws InputError, and leaves nothing
/// behind, for fewer than two files; a file that is given twice, damaged, being written, or unfinished; files that
/// differ in task, settings or version; shards of different families; a shard that is there twice or missing; a problem
/// that two files hold; an `out` that exists.
MergeSummary MergeDatabases(const std::vector<std::string>& parts, const std::string& out,
                            const ProgressCallback& progress = {}, const CancellationToken* cancellation = nullptr);

}  // namespace feeler::policies
