#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <unordered_map>
#include <vector>

#include "feeler/planner/pomdp/model/pomdp.h"
#include "feeler/planner/pomdp/model/pulse.h"

namespace feeler::planner {

/// Rows of probabilities as a file gives them: in any order, later entries overriding earlier ones.
class RowsBuilder {
 public:
  RowsBuilder(std::size_t rows, std::size_t columns) : columns_(columns), rows_(rows), lines_(rows, 0) {}

  /// One entry; `line` of the file says where a row was last touched.
  void Set(std::size_t row, std::uint32_t column, double value, int line);
  /// Every entry of the row.
  void Fill(std::size_t row, double value, int line);
  /// The whole row at once.
  void Assign(std::size_t row, std::vector<SparseEntry> entries, int line);

  /// Entries held, overridden ones included.
  std::size_t entries() const { return entries_; }

  /// The rows, normalised. `fail(row, sum, line)` must throw; called where a row does not sum to 1.
  SparseRows Finish(const std::function<void(std::size_t row, double sum, int line)>& fail, Pulse& pulse);

 private:
  std::size_t columns_;
  std::vector<std::vector<SparseEntry>> rows_;
  std::vector<int> lines_;
  std::size_t entries_ = 0;
};

/// Sums of probabilities that differ from 1 by less than this are rounding of the file's decimals, and are made 1.
inline constexpr double kSumTolerance = 1e-5;

/// Rewards R(a, s, s', o) as a file gives them: each statement sets all that its wildcards stand for, later ones
/// override earlier ones. Kept as statements, so memory is that of the file.
class RewardStatements {
 public:
  static constexpr std::uint32_t kAny = ~std::uint32_t{0};
  RewardStatements(std::size_t actions, std::size_t states, std::size_t observations)
      : actions_(actions), states_(states), observations_(observations) {}

  void Set(std::uint32_t action, std::uint32_t from, std::uint32_t to, std::uint32_t observation, double value);
  std::size_t size() const { return statements_.size(); }
  /// R(a, s), expected over s' and o, for all actions and states (At(a, s) = a |S| + s).
  std::vector<double> Expected(const SparseRows& transitions, const SparseRows& observation_rows, Pulse& pulse) const;

 private:
  struct Statement {
    double value = 0.0;
    std::uint64_t order = 0;
  };
  std::uint64_t Key(std::uint32_t a, std::uint32_t s, std::uint32_t next, std::uint32_t o) const;
  /// Whether statements that may hold for a and s name s' (bit 0) or o (bit 1).
  unsigned Detail(std::uint32_t a, std::uint32_t s) const;
  double Find(std::uint32_t a, std::uint32_t s, std::uint32_t next, std::uint32_t o) const;

  std::size_t actions_, states_, observations_;
  std::unordered_map<std::uint64_t, Statement> statements_;
  std::unordered_map<std::uint64_t, unsigned> detail_;  ///< by a and s
  bool patterns_[16] = {};                              ///< bit 0: a given, 1: s, 2: s', 3: o
  std::uint64_t order_ = 0;
};

}  // namespace feeler::planner
