#include <fmt/format.h>

#include "feeler/planner/pomdp/files/pomdp_file.h"

namespace feeler::planner {
namespace {

std::string Decimal(double value) {
  std::string text = fmt::format("{}", value);
  if (text.find_first_of("eE") != std::string::npos) text = fmt::format("{:.20f}", value);
  return text.find('.') == std::string::npos ? text + ".0" : text;
}

}  // namespace

std::string FormatCassandraPomdp(const Pomdp& pomdp) {
  std::string text = fmt::format("discount: {}\nvalues: reward\n", Decimal(pomdp.discount));
  const auto list = [&](const char* key, const std::vector<std::string>& names) {
    text += key;
    if (!names.empty() && names[0][0] >= '0' && names[0][0] <= '9') {
      text += fmt::format(" {}", names.size());
    } else {
      for (const std::string& name : names) text += " " + name;
    }
    text += "\n";
  };
  list("states:", pomdp.states);
  list("actions:", pomdp.actions);
  list("observations:", pomdp.observations);
  std::vector<double> start(pomdp.state_count(), 0.0);
  for (const SparseEntry& s : pomdp.start) start[s.index] = s.value;
  text += "start:";
  for (const double p : start) text += " " + Decimal(p);
  text += "\n\n";
  for (std::size_t a = 0; a < pomdp.action_count(); ++a) {
    for (std::size_t s = 0; s < pomdp.state_count(); ++s) {
      const std::string& action = pomdp.actions[a];
      const std::string& state = pomdp.states[s];
      for (const SparseEntry& next : pomdp.transitions.Row(pomdp.At(a, s))) {
        text += fmt::format("T: {} : {} : {} {}\n", action, state, pomdp.states[next.index], Decimal(next.value));
      }
      for (const SparseEntry& o : pomdp.observation_rows.Row(pomdp.At(a, s))) {
        text += fmt::format("O: {} : {} : {} {}\n", action, state, pomdp.observations[o.index], Decimal(o.value));
      }
      const double reward = pomdp.reward[pomdp.At(a, s)];
      if (reward != 0.0) text += fmt::format("R: {} : {} : * : * {}\n", action, state, Decimal(reward));
    }
  }
  return text;
}

}  // namespace feeler::planner
