#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace feeler::policies {

/// XXH64 (Collet 2012) of the bytes; the same on every platform.
std::uint64_t Hash64(std::string_view bytes, std::uint64_t seed = 0);

/// 128 bits as 32 hexadecimal digits: Hash64 under two seeds. Tells contents apart; not meant against forgery.
std::string HashText(std::string_view bytes);

}  // namespace feeler::policies
