#include "feeler/planner/pomdp/files/factor_table.h"

#include <algorithm>

namespace feeler::planner {

FactorTable::FactorTable(const std::vector<FactorVariable>& variables, std::vector<std::size_t> scope, bool has_target,
                         int line)
    : variables_(variables), scope_(std::move(scope)), line_(line) {
  if (has_target) target_ = scope_.back();
}

void FactorTable::Set(const std::vector<std::uint32_t>& instance, double value, int line) {
  std::vector<std::size_t> given;
  std::uint64_t key = 0;
  for (std::size_t i = 0; i < parents(); ++i) {
    if (instance[i] == kAny) continue;
    given.push_back(i);
    key = key * variables_[scope_[i]].count() + instance[i];
  }
  auto pattern = std::ranges::find(patterns_, given, &Pattern::given);
  if (pattern == patterns_.end()) pattern = patterns_.insert(patterns_.end(), {given, {}});
  std::vector<Item>& items = pattern->items[key];
  const std::uint32_t target = target_ == kNoTarget ? kAny : instance.back();
  if (target == kAny) items.clear();  // overrides them all
  items.push_back({target, value, ++order_, line});
}

std::uint32_t FactorTable::Add(Node node) {
  nodes_.push_back(std::move(node));
  root_ = static_cast<std::uint32_t>(nodes_.size() - 1);
  return root_;
}

int FactorTable::Position(std::size_t variable) const {
  const auto found = std::ranges::find(scope_, variable);
  return found == scope_.end() ? -1 : static_cast<int>(found - scope_.begin());
}

double FactorTable::NodeValue(std::uint32_t node, const Assignment& at) const {
  const Node* n = &nodes_[node];
  while (n->kind == NodeKind::kBranch) n = &nodes_[n->children[at[n->variable]]];
  switch (n->kind) {
    case NodeKind::kDeterministic: return at[n->variable] == n->chosen ? 1.0 : 0.0;
    case NodeKind::kPersistent: return at[n->variable] == at[n->before] ? 1.0 : 0.0;
    case NodeKind::kUniform: return 1.0 / static_cast<double>(variables_[n->variable].count());
    case NodeKind::kBranch:
    case NodeKind::kTerminal: break;
  }
  return n->value;
}

std::uint32_t FactorTable::NodeOfParents(const Assignment& at) const {
  std::uint32_t node = root_;
  while (nodes_[node].kind == NodeKind::kBranch && nodes_[node].variable != target_) {
    node = nodes_[node].children[at[nodes_[node].variable]];
  }
  return node;
}

std::vector<const FactorTable::Item*> FactorTable::ItemsOf(const Assignment& at) const {
  std::vector<const Item*> items;
  for (const Pattern& pattern : patterns_) {
    std::uint64_t key = 0;
    for (const std::size_t i : pattern.given) key = key * variables_[scope_[i]].count() + at[scope_[i]];
    const auto found = pattern.items.find(key);
    if (found == pattern.items.end()) continue;
    for (const Item& item : found->second) items.push_back(&item);
  }
  if (patterns_.size() > 1) std::ranges::sort(items, {}, &Item::order);
  return items;
}

int FactorTable::LineOf(const Assignment& at) const {
  if (!nodes_.empty()) return nodes_[NodeOfParents(at)].line;
  const std::vector<const Item*> items = ItemsOf(at);
  return items.empty() ? line_ : items.back()->line;
}

void FactorTable::Distribution(Assignment& at, std::vector<SparseEntry>& out) const {
  out.clear();
  const std::size_t count = variables_[target_].count();
  if (!nodes_.empty()) {
    const std::uint32_t node = NodeOfParents(at);
    const Node& n = nodes_[node];
    if (n.kind == NodeKind::kDeterministic && n.variable == target_) return out.push_back({n.chosen, 1.0});
    if (n.kind == NodeKind::kPersistent && n.variable == target_) return out.push_back({at[n.before], 1.0});
    for (std::uint32_t v = 0; v < count; ++v) {
      at[target_] = v;
      const double p = NodeValue(node, at);
      if (p != 0.0) out.push_back({v, p});
    }
    return;
  }
  const std::vector<const Item*> items = ItemsOf(at);
  const auto put = [&](std::uint32_t v, double p) {
    const auto found = std::ranges::find(out, v, &SparseEntry::index);
    if (found != out.end()) {
      found->value = p;
    } else {
      out.push_back({v, p});
    }
  };
  for (const Item* item : items) {
    if (item->target != kAny) {
      put(item->target, item->value);
      continue;
    }
    out.clear();
    for (std::uint32_t v = 0; v < count; ++v) out.push_back({v, item->value});
  }
  std::erase_if(out, [](const SparseEntry& entry) { return entry.value == 0.0; });
  std::ranges::sort(out, {}, &SparseEntry::index);
}

double FactorTable::Value(const Assignment& at) const {
  if (!nodes_.empty()) return NodeValue(root_, at);
  const Item* last = nullptr;
  for (const Pattern& pattern : patterns_) {
    std::uint64_t key = 0;
    for (const std::size_t i : pattern.given) key = key * variables_[scope_[i]].count() + at[scope_[i]];
    const auto found = pattern.items.find(key);
    if (found == pattern.items.end()) continue;
    if (last == nullptr || found->second.back().order > last->order) last = &found->second.back();
  }
  return last == nullptr ? 0.0 : last->value;
}

std::string FactorTable::Describe(const Assignment& at) const {
  std::string text;
  for (std::size_t i = 0; i < parents(); ++i) {
    text += (text.empty() ? "" : ", ") + variables_[scope_[i]].values[at[scope_[i]]];
  }
  return text.empty() ? "no parents" : text;
}

}  // namespace feeler::planner
