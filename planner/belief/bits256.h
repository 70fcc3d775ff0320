#pragma once

#include <array>
#include <bit>
#include <cstdint>

namespace feeler::planner {

/// A set of the cells (x, y) of a 16 x 16 window; cell (x, y) is bit x + 16 y.
struct Bits256 {
  std::array<std::uint64_t, 4> word{};

  static Bits256 Cell(int x, int y) {
    Bits256 bits;
    bits.Set(x + 16 * y);
    return bits;
  }
  void Set(int bit) { word[static_cast<std::size_t>(bit >> 6)] |= std::uint64_t{1} << (bit & 63); }
  bool Test(int bit) const { return (word[static_cast<std::size_t>(bit >> 6)] >> (bit & 63) & 1) != 0; }
  bool Any() const { return (word[0] | word[1] | word[2] | word[3]) != 0; }
  int Count() const {
    return std::popcount(word[0]) + std::popcount(word[1]) + std::popcount(word[2]) + std::popcount(word[3]);
  }
  Bits256 operator&(const Bits256& o) const {
    return {{word[0] & o.word[0], word[1] & o.word[1], word[2] & o.word[2], word[3] & o.word[3]}};
  }
  Bits256 operator|(const Bits256& o) const {
    return {{word[0] | o.word[0], word[1] | o.word[1], word[2] | o.word[2], word[3] | o.word[3]}};
  }
  Bits256 Without(const Bits256& o) const {
    return {{word[0] & ~o.word[0], word[1] & ~o.word[1], word[2] & ~o.word[2], word[3] & ~o.word[3]}};
  }
  bool operator==(const Bits256&) const = default;

  /// Every bit moved `by` places down (towards bit 0), 0 <= by < 256.
  Bits256 Down(int by) const {
    Bits256 moved;
    const int words = by >> 6;
    const int bits = by & 63;
    for (int i = 0; i + words < 4; ++i) {
      const auto from = static_cast<std::size_t>(i + words);
      moved.word[static_cast<std::size_t>(i)] = word[from] >> bits;
      if (bits != 0 && from + 1 < 4) moved.word[static_cast<std::size_t>(i)] |= word[from + 1] << (64 - bits);
    }
    return moved;
  }
  /// Every bit moved `by` places up, 0 <= by < 256.
  Bits256 Up(int by) const {
    Bits256 moved;
    const int words = by >> 6;
    const int bits = by & 63;
    for (int i = 3; i >= words; --i) {
      const auto from = static_cast<std::size_t>(i - words);
      moved.word[static_cast<std::size_t>(i)] = word[from] << bits;
      if (bits != 0 && from > 0) moved.word[static_cast<std::size_t>(i)] |= word[from - 1] >> (64 - bits);
    }
    return moved;
  }

  /// Calls f(bit) for every bit set, ascending.
  template <class F>
  void ForEach(F f) const {
    for (int i = 0; i < 4; ++i) {
      for (std::uint64_t rest = word[static_cast<std::size_t>(i)]; rest != 0; rest &= rest - 1) {
        f(64 * i + std::countr_zero(rest));
      }
    }
  }
};

}  // namespace feeler::planner
