#include "feeler/core/random.h"

#include <bit>
#include <cassert>
#include <cmath>
#include <numbers>

namespace feeler {
namespace {

std::uint64_t SplitMix64(std::uint64_t& state) {
  std::uint64_t z = (state += 0x9e3779b97f4a7c15ULL);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

std::uint64_t Fnv1a(std::string_view text) {
  std::uint64_t hash = 0xcbf29ce484222325ULL;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
  return hash;
}

}  // namespace

RandomStream::RandomStream(std::uint64_t seed, std::uint64_t episode, std::string_view purpose) {
  std::uint64_t key = seed;
  std::uint64_t mixed = SplitMix64(key);
  key = mixed ^ episode;
  mixed = SplitMix64(key);
  key = mixed ^ Fnv1a(purpose);
  for (std::uint64_t& word : state_) word = SplitMix64(key);
}

std::uint64_t RandomStream::Next() {
  const std::uint64_t result = std::rotl(state_[0] + state_[3], 23) + state_[0];
  const std::uint64_t t = state_[1] << 17;
  state_[2] ^= state_[0];
  state_[3] ^= state_[1];
  state_[1] ^= state_[2];
  state_[0] ^= state_[3];
  state_[2] ^= t;
  state_[3] = std::rotl(state_[3], 45);
  return result;
}

double RandomStream::Uniform() { return static_cast<double>(Next() >> 11) * 0x1.0p-53; }

double RandomStream::Uniform(double low, double high) { return low + (high - low) * Uniform(); }

std::uint64_t RandomStream::Index(std::uint64_t count) {
  assert(count >= 1);
  const std::uint64_t limit = max() - max() % count;
  std::uint64_t draw = Next();
  while (draw >= limit) draw = Next();
  return draw % count;
}

double RandomStream::Normal() {
  const double radius = std::sqrt(-2.0 * std::log(1.0 - Uniform()));
  return radius * std::cos(2.0 * std::numbers::pi * Uniform());
}

}  // namespace feeler
