#include "feeler/policies/storage/hash.h"

#include <fmt/format.h>

#include <bit>

namespace feeler::policies {
namespace {

constexpr std::uint64_t kPrime1 = 0x9E3779B185EBCA87ULL;
constexpr std::uint64_t kPrime2 = 0xC2B2AE3D27D4EB4FULL;
constexpr std::uint64_t kPrime3 = 0x165667B19E3779F9ULL;
constexpr std::uint64_t kPrime4 = 0x85EBCA77C2B2AE63ULL;
constexpr std::uint64_t kPrime5 = 0x27D4EB2F165667C5ULL;

std::uint64_t LittleEndian(std::string_view bytes, std::size_t at, int count) {
  std::uint64_t value = 0;
  for (int i = 0; i < count; ++i) {
    value |= std::uint64_t{static_cast<unsigned char>(bytes[at + static_cast<std::size_t>(i)])} << (8 * i);
  }
  return value;
}

std::uint64_t Round(std::uint64_t lane, std::uint64_t word) { return std::rotl(lane + word * kPrime2, 31) * kPrime1; }

std::uint64_t MergeRound(std::uint64_t hash, std::uint64_t lane) { return (hash ^ Round(0, lane)) * kPrime1 + kPrime4; }

}  // namespace

std::uint64_t Hash64(std::string_view bytes, std::uint64_t seed) {
  const std::size_t size = bytes.size();
  std::size_t at = 0;
  std::uint64_t hash;
  if (size >= 32) {
    std::uint64_t lanes[4] = {seed + kPrime1 + kPrime2, seed + kPrime2, seed, seed - kPrime1};
    for (; at + 32 <= size; at += 32) {
      for (std::size_t i = 0; i < 4; ++i) lanes[i] = Round(lanes[i], LittleEndian(bytes, at + 8 * i, 8));
    }
    hash = std::rotl(lanes[0], 1) + std::rotl(lanes[1], 7) + std::rotl(lanes[2], 12) + std::rotl(lanes[3], 18);
    for (const std::uint64_t lane : lanes) hash = MergeRound(hash, lane);
  } else {
    hash = seed + kPrime5;
  }
  hash += size;
  for (; at + 8 <= size; at += 8) {
    hash = std::rotl(hash ^ Round(0, LittleEndian(bytes, at, 8)), 27) * kPrime1 + kPrime4;
  }
  if (at + 4 <= size) {
    hash = std::rotl(hash ^ (LittleEndian(bytes, at, 4) * kPrime1), 23) * kPrime2 + kPrime3;
    at += 4;
  }
  for (; at < size; ++at) hash = std::rotl(hash ^ (LittleEndian(bytes, at, 1) * kPrime5), 11) * kPrime1;
  hash = (hash ^ (hash >> 33)) * kPrime2;
  hash = (hash ^ (hash >> 29)) * kPrime3;
  return hash ^ (hash >> 32);
}

std::string HashText(std::string_view bytes) {
  return fmt::format("{:016x}{:016x}", Hash64(bytes, 0), Hash64(bytes, 1));
}

}  // namespace feeler::policies
