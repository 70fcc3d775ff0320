#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "feeler/core/random.h"

namespace feeler::fuzz {

/// One to eight changes drawn from `random`: bits, bytes, numbers and words that have broken readers before, pieces
/// left out, doubled, moved or taken from another seed, brackets in thousands. At most `most` bytes.
std::string Mutate(const std::vector<std::string>& seeds, RandomStream& random, std::size_t most = 1 << 18);

}  // namespace feeler::fuzz
