#pragma once

#include <cstdint>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "feeler/planner/pomdp/model/pomdp.h"

namespace feeler::planner {

/// A variable of a factored model: of states before or after, of actions, of observations.
struct FactorVariable {
  std::string name;
  std::vector<std::string> values;
  std::size_t count() const { return values.size(); }
};

/// A value for each variable, by its index.
using Assignment = std::vector<std::uint32_t>;

/// A function of a few variables: P(target | parents), or a reward of the parents. Filled from a table (`TBL`: entries
/// with wildcards, later ones override earlier ones) or a decision diagram (`DD`).
class FactorTable {
 public:
  static constexpr std::uint32_t kAny = ~std::uint32_t{0};
  static constexpr std::size_t kNoTarget = ~std::size_t{0};

  /// `scope`: indices of the parents, then of the target where there is one. The variables must outlive the table.
  FactorTable(const std::vector<FactorVariable>& variables, std::vector<std::size_t> scope, bool has_target, int line);

  /// A table entry: a value or kAny for each variable of the scope; `line` of the file.
  void Set(const std::vector<std::uint32_t>& instance, double value, int line);
  std::size_t entries() const { return order_; }

  /// Nodes of the diagram; the root is the one added last. Return the number of the node.
  enum class NodeKind { kTerminal, kBranch, kDeterministic, kPersistent, kUniform };
  struct Node {
    NodeKind kind = NodeKind::kTerminal;
    double value = 0.0;                   ///< kTerminal
    std::size_t variable = 0;             ///< all others
    std::uint32_t chosen = 0;             ///< kDeterministic
    std::size_t before = 0;               ///< kPersistent: the variable whose value stays
    std::vector<std::uint32_t> children;  ///< kBranch: one a value
    int line = 0;
  };
  std::uint32_t Add(Node node);
  void SetRoot(std::uint32_t node) { root_ = node; }

  /// P(target | parents) for an assignment of the parents: nonzeros by ascending value. `at` is scratch in its target.
  void Distribution(Assignment& at, std::vector<SparseEntry>& out) const;
  /// The value of a function without target.
  double Value(const Assignment& at) const;

  const std::vector<std::size_t>& scope() const { return scope_; }
  std::size_t target() const { return target_; }
  int line() const { return line_; }
  /// Of what gives the distribution for an assignment of the parents: the last entry, the branch of the diagram.
  int LineOf(const Assignment& at) const;
  /// Index in the scope; -1 where it is not in it.
  int Position(std::size_t variable) const;
  /// "a, s0" : the values of the parents, for errors.
  std::string Describe(const Assignment& at) const;

 private:
  struct Item {
    std::uint32_t target = kAny;
    double value = 0.0;
    std::size_t order = 0;
    int line = 0;
  };
  /// Entries that give the same parents; all others are wildcards there.
  struct Pattern {
    std::vector<std::size_t> given;  ///< positions in the scope
    std::unordered_map<std::uint64_t, std::vector<Item>> items;
  };
  std::size_t parents() const { return scope_.size() - (target_ == kNoTarget ? 0 : 1); }
  /// The node that the values of the parents lead to.
  std::uint32_t NodeOfParents(const Assignment& at) const;
  /// The entries for the values of the parents, by ascending order.
  std::vector<const Item*> ItemsOf(const Assignment& at) const;
  double NodeValue(std::uint32_t node, const Assignment& at) const;

  const std::vector<FactorVariable>& variables_;
  std::vector<std::size_t> scope_;
  std::size_t target_ = kNoTarget;
  int line_ = 0;
  std::vector<Pattern> patterns_;
  std::size_t order_ = 0;
  std::vector<Node> nodes_;
  std::uint32_t root_ = 0;
};

}  // namespace feeler::planner
