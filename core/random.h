#pragma once

#include <cstdint>
#include <string_view>

namespace feeler {

/// A stream of random numbers keyed by (seed, episode, purpose). Streams of different keys are independent, so
/// episode k draws the same numbers alone or among thousands, on one thread or many. The generator is
/// xoshiro256++ (Blackman and Vigna 2021) seeded through SplitMix64; draws are the same on every platform.
class RandomStream {
 public:
  using result_type = std::uint64_t;

  RandomStream(std::uint64_t seed, std::uint64_t episode, std::string_view purpose);

  static constexpr result_type min() { return 0; }
  static constexpr result_type max() { return ~std::uint64_t{0}; }
  result_type operator()() { return Next(); }

  std::uint64_t Next();
  /// Uniform in [0, 1).
  double Uniform();
  /// Uniform in [low, high).
  double Uniform(double low, double high);
  /// Uniform in 0..count-1, count >= 1, without modulo bias.
  std::uint64_t Index(std::uint64_t count);
  /// Standard normal (Box and Muller 1958).
  double Normal();

 private:
  std::uint64_t state_[4];
};

}  // namespace feeler
