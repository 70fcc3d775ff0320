#include <fmt/format.h>

#include <iterator>

#include "feeler/planner/pomdp/files/pomdp_file.h"

namespace feeler::planner {
namespace {

std::string XmlDecimal(double value) {
  std::string text = fmt::format("{}", value);
  if (text.find_first_of("eE") != std::string::npos) text = fmt::format("{:.20f}", value);
  return text.find('.') == std::string::npos ? text + ".0" : text;
}

std::string Joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : " ") + name;
  return text;
}

}  // namespace

std::string FormatPomdpx(const Pomdp& pomdp) {
  std::string text;
  const auto out = std::back_inserter(text);
  const auto entry = [&](const std::string& instance, const char* table, double value) {
    fmt::format_to(out, "    <Entry><Instance>{}</Instance><{}>{}</{}></Entry>\n", instance, table, XmlDecimal(value),
                   table);
  };
  const auto open = [&](const char* tag, const char* variable, const char* parents) {
    fmt::format_to(out, "  <{}><Var>{}</Var><Parent>{}</Parent><Parameter type=\"TBL\">\n", tag, variable, parents);
  };
  text += "<?xml version=\"1.0\" encoding=\"ISO-8859-1\"?>\n<pomdpx version=\"1.0\" id=\"feeler\">\n";
  fmt::format_to(out, " <Discount>{}</Discount>\n <Variable>\n", XmlDecimal(pomdp.discount));
  fmt::format_to(out,
                 "  <StateVar vnamePrev=\"state_0\" vnameCurr=\"state_1\"><ValueEnum>{}</ValueEnum></StateVar>\n"
                 "  <ObsVar vname=\"reading\"><ValueEnum>{}</ValueEnum></ObsVar>\n"
                 "  <ActionVar vname=\"action\"><ValueEnum>{}</ValueEnum></ActionVar>\n"
                 "  <RewardVar vname=\"reward\"/>\n </Variable>\n",
                 Joined(pomdp.states), Joined(pomdp.observations), Joined(pomdp.actions));
  text += " <InitialStateBelief>\n";
  open("CondProb", "state_0", "null");
  for (const SparseEntry& s : pomdp.start) entry(pomdp.states[s.index], "ProbTable", s.value);
  text += "  </Parameter></CondProb>\n </InitialStateBelief>\n <StateTransitionFunction>\n";
  const auto rows = [&](const SparseRows& table, const std::vector<std::string>& names) {
    for (std::size_t a = 0; a < pomdp.action_count(); ++a) {
      for (std::size_t s = 0; s < pomdp.state_count(); ++s) {
        for (const SparseEntry& e : table.Row(pomdp.At(a, s))) {
          entry(pomdp.actions[a] + " " + pomdp.states[s] + " " + names[e.index], "ProbTable", e.value);
        }
      }
    }
  };
  open("CondProb", "state_1", "action state_0");
  rows(pomdp.transitions, pomdp.states);
  text += "  </Parameter></CondProb>\n </StateTransitionFunction>\n <ObsFunction>\n";
  open("CondProb", "reading", "action state_1");
  rows(pomdp.observation_rows, pomdp.observations);
  text += "  </Parameter></CondProb>\n </ObsFunction>\n <RewardFunction>\n";
  open("Func", "reward", "action state_0");
  for (std::size_t a = 0; a < pomdp.action_count(); ++a) {
    for (std::size_t s = 0; s < pomdp.state_count(); ++s) {
      const double reward = pomdp.reward[pomdp.At(a, s)];
      if (reward != 0.0) entry(pomdp.actions[a] + " " + pomdp.states[s], "ValueTable", reward);
    }
  }
  text += "  </Parameter></Func>\n </RewardFunction>\n</pomdpx>\n";
  return text;
}

}  // namespace feeler::planner
