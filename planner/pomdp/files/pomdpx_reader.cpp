// APPL's `.pomdpx` format, version 1.0: one function an element of the format.
#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <map>
#include <optional>
#include <sstream>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/planner/pomdp/files/cassandra_tokens.h"
#include "feeler/planner/pomdp/files/factored_model.h"
#include "feeler/planner/pomdp/files/pomdp_file.h"
#include "feeler/planner/pomdp/files/table_builder.h"

namespace feeler::planner {
namespace {

using tinyxml2::XMLElement;

std::vector<std::string> Words(const char* text) {
  std::istringstream in(text == nullptr ? "" : text);
  return {std::istream_iterator<std::string>(in), {}};
}

class Reader {
 public:
  /// Fills `model`, whose tables then refer to its variables: it must stay where it is.
  Reader(FactoredPomdp& model, Pulse& pulse) : model_(model), pulse_(pulse) {}

  void Read(std::string_view text) {
    tinyxml2::XMLDocument document;
    if (document.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS) {
      throw InputError(fmt::format("{}:{}", model_.name, document.ErrorLineNum()),
                       fmt::format("no complete XML ({})", document.ErrorName()), "is the file complete?");
    }
    const XMLElement* root = document.RootElement();
    if (root == nullptr || std::string_view(root->Name()) != "pomdpx") {
      throw InputError(fmt::format("{}:{}", model_.name, root == nullptr ? 1 : root->GetLineNum()),
                       "the root is no <pomdpx>", "give a PomdpX file");
    }
    RequireKnown(*root, {"Description", "Discount", "Variable", "InitialStateBelief", "StateTransitionFunction",
                         "ObsFunction", "RewardFunction"});
    const XMLElement& discount = Child(*root, "Discount");
    model_.discount_line = discount.GetLineNum();
    model_.discount = Number(discount, Word(discount));
    if (!(model_.discount > 0.0 && model_.discount <= 1.0)) {
      Fail(discount, fmt::format("discount {:g} is not in (0, 1]", model_.discount), "give one above 0 and at most 1");
    }
    Variables(Child(*root, "Variable"));
    Tables(Child(*root, "InitialStateBelief"), "CondProb", "b", "b", model_.initial);
    Tables(Child(*root, "StateTransitionFunction"), "CondProb", "a", "uba", model_.transitions);
    if (!model_.observations.empty()) Tables(Child(*root, "ObsFunction"), "CondProb", "o", "uao", model_.sensors);
    if (const XMLElement* rewards = root->FirstChildElement("RewardFunction")) {
      Tables(*rewards, "Func", "", "ubao", model_.rewards);
    }
    RequireAll(*root);
  }

 private:
  [[noreturn]] void Fail(const XMLElement& at, const std::string& what, const std::string& mend) const {
    throw InputError(fmt::format("{}:{}", model_.name, at.GetLineNum()), what, mend);
  }
  const XMLElement& Child(const XMLElement& of, const char* name) const {
    const XMLElement* child = of.FirstChildElement(name);
    if (child == nullptr) Fail(of, fmt::format("<{}> without <{}>", of.Name(), name), "add it");
    return *child;
  }
  /// Nothing but these in an element, each once at most but for what ends in '*'.
  void RequireKnown(const XMLElement& of, std::initializer_list<std::string_view> known) const {
    std::vector<std::string_view> met;
    for (const XMLElement* e = of.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      const std::string_view name = e->Name();
      if (std::ranges::find(known, std::string(name) + "*") != known.end()) continue;
      if (std::ranges::find(known, name) == known.end()) {
        Fail(*e, fmt::format("<{}> in <{}>", name, of.Name()), fmt::format("{} belong there", Listed(known)));
      }
      if (std::ranges::find(met, name) != met.end()) {
        Fail(*e, fmt::format("<{}> twice in <{}>", name, of.Name()), "leave one out");
      }
      met.push_back(name);
    }
  }
  static std::string Listed(std::initializer_list<std::string_view> names) {
    std::string text;
    for (const std::string_view name : names) {
      text += (text.empty() ? "" : ", ") + std::string(name.substr(0, name.find('*')));
    }
    return text;
  }
  std::string Word(const XMLElement& element) const {
    const std::vector<std::string> words = Words(element.GetText());
    if (words.size() != 1) Fail(element, fmt::format("<{}> should hold one word", element.Name()), "give it");
    return words[0];
  }
  double Number(const XMLElement& element, std::string_view word) const {
    if (!CassandraTokens::IsNumber(word)) Fail(element, fmt::format("\"{}\" is no number", word), "give one");
    if (word.starts_with('+')) word.remove_prefix(1);
    double value = 0.0;
    std::from_chars(word.data(), word.data() + word.size(), value);
    return value;
  }
  void RequireProbability(const XMLElement& element, double value) const {
    if (value >= 0.0 && value <= 1.0 + kSumTolerance) return;
    Fail(element, fmt::format("{:g} is no probability", value), "give 0 to 1");
  }
  std::string Attribute(const XMLElement& element, const char* name) const {
    const char* value = element.Attribute(name);
    if (value == nullptr || *value == 0) Fail(element, fmt::format("<{}> without {}", element.Name(), name), "add it");
    return value;
  }

  /// `<ValueEnum>` names or `<NumValues>`: s0, s1, ... as the format says.
  std::vector<std::string> Values(const XMLElement& element, const char* prefix) const {
    RequireKnown(element, {"ValueEnum", "NumValues"});
    if (element.FirstChildElement("ValueEnum") != nullptr && element.FirstChildElement("NumValues") != nullptr) {
      Fail(element, "values and their number", "leave one out");
    }
    if (const XMLElement* names = element.FirstChildElement("ValueEnum")) {
      std::vector<std::string> values = Words(names->GetText());
      if (values.empty()) Fail(*names, "no values", "list them");
      return values;
    }
    const XMLElement& count = Child(element, "NumValues");
    const double number = Number(count, Word(count));
    if (!(number >= 1.0) || number != std::floor(number)) {
      Fail(count, fmt::format("{:g} values", number), "give a whole number of at least 1");
    }
    RequireFits(fmt::format("{}:{}", model_.name, count.GetLineNum()), number, 1.0, number);
    std::vector<std::string> values;
    for (std::size_t i = 0; i < static_cast<std::size_t>(number); ++i) values.push_back(fmt::format("{}{}", prefix, i));
    return values;
  }

  std::size_t AddVariable(const XMLElement& element, const std::string& name, const std::vector<std::string>& values,
                          char scope) {
    if (!index_.emplace(name, model_.variables.size()).second)
      Fail(element, fmt::format("variable \"{}\" twice", name), "rename one");
    std::map<std::string, std::uint32_t> numbers;
    for (std::size_t v = 0; v < values.size(); ++v) {
      if (!numbers.emplace(values[v], v).second)
        Fail(element, fmt::format("value \"{}\" twice", values[v]), "leave one out");
    }
    numbers_.push_back(std::move(numbers));
    scope_of_.push_back(scope);
    model_.variables.push_back({name, values});
    return model_.variables.size() - 1;
  }

  void Variables(const XMLElement& element) {
    for (const XMLElement* v = element.FirstChildElement(); v != nullptr; v = v->NextSiblingElement()) {
      const std::string_view kind = v->Name();
      if (kind == "StateVar") {
        const std::vector<std::string> values = Values(*v, "s");
        const std::size_t before = AddVariable(*v, Attribute(*v, "vnamePrev"), values, 'b');
        const std::size_t after = AddVariable(*v, Attribute(*v, "vnameCurr"), values, 'a');
        const std::string observed = v->Attribute("fullyObs") == nullptr ? "false" : v->Attribute("fullyObs");
        if (observed != "true" && observed != "false") {
          Fail(*v, fmt::format("fullyObs=\"{}\"", observed), "true or false");
        }
        model_.states.push_back({before, after, observed == "true"});
      } else if (kind == "ObsVar") {
        model_.observations.push_back(AddVariable(*v, Attribute(*v, "vname"), Values(*v, "o"), 'o'));
      } else if (kind == "ActionVar") {
        model_.actions.push_back(AddVariable(*v, Attribute(*v, "vname"), Values(*v, "a"), 'u'));
      } else if (kind == "RewardVar") {
        reward_names_.push_back(Attribute(*v, "vname"));
      } else {
        Fail(*v, fmt::format("<{}> is no variable", kind), "StateVar, ObsVar, ActionVar or RewardVar");
      }
    }
    if (model_.states.empty()) Fail(element, "no state variable", "add a StateVar");
    if (model_.actions.empty()) Fail(element, "no action variable", "add an ActionVar");
  }

  std::size_t Variable(const XMLElement& at, const std::string& name, std::string_view allowed) const {
    const auto found = index_.find(name);
    if (found == index_.end()) Fail(at, fmt::format("unknown variable \"{}\"", name), "declare it under <Variable>");
    if (allowed.find(scope_of_[found->second]) == std::string_view::npos) {
      Fail(at, fmt::format("variable \"{}\" does not belong here", name), "see docs/pomdp.md");
    }
    return found->second;
  }
  std::uint32_t Value(const XMLElement& at, std::size_t variable, const std::string& name) const {
    const auto found = numbers_[variable].find(name);
    if (found == numbers_[variable].end()) {
      Fail(at, fmt::format("unknown value \"{}\" of variable \"{}\"", name, model_.variables[variable].name),
           "list it");
    }
    return found->second;
  }

  /// The parents of a table, then its variable unless it is a reward.
  std::vector<std::size_t> Scope(const XMLElement& f, std::string_view targets, std::string_view parents) const {
    RequireKnown(f, {"Var", "Parent", "Parameter"});
    std::vector<std::size_t> scope;
    const XMLElement* list = f.FirstChildElement("Parent");
    for (const std::string& word : Words(list == nullptr ? nullptr : list->GetText())) {
      if (word == "null") continue;
      scope.push_back(Variable(*list, word, parents));
      if (std::ranges::count(scope, scope.back()) > 1) {
        Fail(*list, fmt::format("parent \"{}\" twice", word), "leave one out");
      }
    }
    const XMLElement& var = Child(f, "Var");
    const std::string name = Word(var);
    if (!targets.empty()) {
      scope.push_back(Variable(var, name, targets));
      if (std::ranges::count(scope, scope.back()) > 1) {
        Fail(*list, fmt::format("variable \"{}\" is a parent of its own", name), "leave it out");
      }
    } else if (std::ranges::find(reward_names_, name) == reward_names_.end()) {
      Fail(var, fmt::format("unknown reward variable \"{}\"", name), "declare it as a RewardVar");
    }
    return scope;
  }

  /// All tables of a section. `targets` and `parents`: kinds of variables that may stand there (u action, b state
  /// before, a state after, o observation).
  void Tables(const XMLElement& section, const char* kind, std::string_view targets, std::string_view parents,
              std::vector<FactorTable>& into) {
    for (const XMLElement* f = section.FirstChildElement(); f != nullptr; f = f->NextSiblingElement()) {
      if (std::string_view(f->Name()) != kind)
        Fail(*f, fmt::format("<{}> in <{}>", f->Name(), section.Name()), fmt::format("<{}> belongs here", kind));
      const std::vector<std::size_t> scope = Scope(*f, targets, parents);
      double size = 1.0;
      for (const std::size_t v : scope) size *= static_cast<double>(model_.variables[v].count());
      if (size > 1e18) Fail(*f, "a table over too many values", "leave parents out");
      FactorTable& table = into.emplace_back(model_.variables, scope, !targets.empty(), f->GetLineNum());
      const XMLElement& parameter = Child(*f, "Parameter");
      const std::string type = parameter.Attribute("type") == nullptr ? "TBL" : parameter.Attribute("type");
      if (type == "TBL") {
        RequireKnown(parameter, {"Entry*"});
        for (const XMLElement* e = parameter.FirstChildElement("Entry"); e != nullptr;
             e = e->NextSiblingElement("Entry")) {
          Entry(*e, table, !targets.empty());
        }
      } else if (type == "DD") {
        Diagram(parameter, table);
      } else {
        Fail(parameter, fmt::format("unknown type \"{}\"", type), "TBL or DD");
      }
    }
  }

  /// `*` stands for every value; `-` too, with a number of the table for each, the last `-` fastest.
  void Entry(const XMLElement& entry, FactorTable& table, bool probability) {
    RequireKnown(entry, {"Instance", "ProbTable", "ValueTable"});
    const XMLElement& instance = Child(entry, "Instance");
    const std::vector<std::string> words = Words(instance.GetText());
    const std::vector<std::size_t>& scope = table.scope();
    if (words.size() != scope.size()) {
      Fail(instance, fmt::format("{} values for {} variables", words.size(), scope.size()),
           "one a parent, then the variable's own");
    }
    std::vector<std::uint32_t> at(scope.size(), FactorTable::kAny);
    std::vector<std::size_t> listed;
    double count = 1.0;
    for (std::size_t i = 0; i < scope.size(); ++i) {
      if (words[i] == "*") continue;
      if (words[i] == "-") {
        listed.push_back(i);
        count *= static_cast<double>(model_.variables[scope[i]].count());
      } else {
        at[i] = Value(instance, scope[i], words[i]);
      }
    }
    const char* kinds[] = {"ProbTable", "ValueTable"};
    const XMLElement* values = entry.FirstChildElement(kinds[probability ? 0 : 1]);
    if (values == nullptr) values = &Child(entry, kinds[probability ? 1 : 0]);
    std::vector<std::string> numbers = Words(values->GetText());
    RequireFits(fmt::format("{}:{}", model_.name, values->GetLineNum()), 1.0, 1.0,
                static_cast<double>(table.entries()) + count);
    const bool uniform = numbers.size() == 1 && numbers[0] == "uniform";
    const bool identity = numbers.size() == 1 && numbers[0] == "identity";
    const auto size = [&](std::size_t i) { return model_.variables[scope[listed[i]]].count(); };
    if (identity && (listed.size() != 2 || size(0) != size(1))) {
      Fail(*values, "identity, and the table is not square", "it takes two - of equal size");
    }
    if (!uniform && !identity && static_cast<double>(numbers.size()) != count) {
      Fail(*values, fmt::format("{} numbers for {:g} entries", numbers.size(), count),
           "give one for each value of each -");
    }
    if (uniform && !probability) Fail(*values, "uniform rewards", "give numbers");
    pulse_(kNumberWork * numbers.size());
    const double share = probability ? 1.0 / static_cast<double>(model_.variables[scope.back()].count()) : 0.0;
    for (std::size_t n = 0; n < static_cast<std::size_t>(count); ++n) {
      pulse_(kNumberWork);
      std::size_t rest = n;
      for (std::size_t i = listed.size(); i-- > 0;) {
        at[listed[i]] = static_cast<std::uint32_t>(rest % size(i));
        rest /= size(i);
      }
      double value = share;
      if (identity) value = at[listed[0]] == at[listed[1]] ? 1.0 : 0.0;
      if (!uniform && !identity) value = Number(*values, numbers[n]);
      if (probability) RequireProbability(*values, value);
      table.Set(at, value, entry.GetLineNum());
    }
  }

  void Diagram(const XMLElement& parameter, FactorTable& table) {
    RequireKnown(parameter, {"DAG", "SubDAGTemplate*"});
    std::map<std::string, const XMLElement*> templates;
    for (const XMLElement* t = parameter.FirstChildElement("SubDAGTemplate"); t != nullptr;
         t = t->NextSiblingElement("SubDAGTemplate")) {
      if (!templates.emplace(Attribute(*t, "id"), t).second) Fail(*t, "a template twice", "leave one out");
    }
    std::map<std::string, std::uint32_t> shared;
    table.SetRoot(Below(Child(parameter, "DAG"), table, templates, shared, 0));
  }

  /// The node that an element (a DAG, an Edge, a template) holds.
  std::uint32_t Below(const XMLElement& holder, FactorTable& table,
                      const std::map<std::string, const XMLElement*>& templates,
                      std::map<std::string, std::uint32_t>& shared, int depth) {
    using Kind = FactorTable::NodeKind;
    if (depth > 200) Fail(holder, "a diagram deeper than 200", "templates must not hold themselves");
    const XMLElement* element = holder.FirstChildElement();
    if (element == nullptr)
      Fail(holder, fmt::format("<{}> holds no branch", holder.Name()), "add a Node, a Terminal or a SubDAG");
    if (const XMLElement* other = element->NextSiblingElement()) {
      Fail(*other, fmt::format("<{}> holds more than one branch", holder.Name()), "leave one out");
    }
    const std::string_view kind = element->Name();
    if (kind == "Terminal") {
      const double value = Number(*element, Word(*element));
      if (table.target() != FactorTable::kNoTarget) RequireProbability(*element, value);
      return table.Add({.kind = Kind::kTerminal, .value = value, .children = {}, .line = element->GetLineNum()});
    }
    if (kind == "Node") return Branch(*element, table, templates, shared, depth);
    if (kind != "SubDAG") Fail(*element, fmt::format("<{}> in a diagram", kind), "Node, Terminal or SubDAG");
    const std::string type = Attribute(*element, "type");
    if (type == "template") {
      const std::string id = Attribute(*element, "idref");
      if (const auto known = shared.find(id); known != shared.end()) return known->second;
      const auto found = templates.find(id);
      if (found == templates.end()) Fail(*element, fmt::format("unknown template \"{}\"", id), "add a SubDAGTemplate");
      return shared[id] = Below(*found->second, table, templates, shared, depth + 1);
    }
    return SubDag(*element, type, table);
  }

  /// A distribution of the variable of the table.
  std::uint32_t SubDag(const XMLElement& element, const std::string& type, FactorTable& table) const {
    using Kind = FactorTable::NodeKind;
    const std::size_t variable = ScopeVariable(element, table);
    const int line = element.GetLineNum();
    if (variable != table.target()) {
      Fail(element,
           fmt::format("{} of \"{}\", which is not the variable of the table", type, Attribute(element, "var")),
           "name that one");
    }
    if (type == "uniform") {
      return table.Add({.kind = Kind::kUniform, .variable = variable, .children = {}, .line = line});
    }
    if (type == "deterministic") {
      return table.Add({.kind = Kind::kDeterministic,
                        .variable = variable,
                        .chosen = Value(element, variable, Attribute(element, "val")),
                        .children = {},
                        .line = line});
    }
    if (type != "persistent")
      Fail(element, fmt::format("unknown SubDAG \"{}\"", type), "uniform, deterministic, persistent or template");
    for (const FactoredPomdp::StateVariable& s : model_.states) {
      if (s.after != variable) continue;
      if (table.Position(s.before) < 0)
        Fail(element, fmt::format("persistent, and \"{}\" is no parent", model_.variables[s.before].name), "add it");
      return table.Add(
          {.kind = Kind::kPersistent, .variable = variable, .before = s.before, .children = {}, .line = line});
    }
    Fail(element, "persistent of no state variable", "name one on arrival");
  }

  std::size_t ScopeVariable(const XMLElement& element, const FactorTable& table) const {
    const std::string name = Attribute(element, "var");
    const std::size_t variable = Variable(element, name, "ubao");
    if (table.Position(variable) < 0)
      Fail(element, fmt::format("variable \"{}\" is no parent", name), "add it to <Parent>");
    return variable;
  }

  std::uint32_t Branch(const XMLElement& node, FactorTable& table,
                       const std::map<std::string, const XMLElement*>& templates,
                       std::map<std::string, std::uint32_t>& shared, int depth) {
    RequireKnown(node, {"Edge*"});
    const std::size_t variable = ScopeVariable(node, table);
    const FactorVariable& v = model_.variables[variable];
    std::vector<std::optional<std::uint32_t>> children(v.count());
    for (const XMLElement* edge = node.FirstChildElement("Edge"); edge != nullptr;
         edge = edge->NextSiblingElement("Edge")) {
      const std::uint32_t value = Value(*edge, variable, Attribute(*edge, "val"));
      if (children[value]) Fail(*edge, fmt::format("branch \"{}\" twice", v.values[value]), "leave one out");
      children[value] = Below(*edge, table, templates, shared, depth + 1);
    }
    FactorTable::Node branch{
        .kind = FactorTable::NodeKind::kBranch, .variable = variable, .children = {}, .line = node.GetLineNum()};
    for (std::size_t i = 0; i < children.size(); ++i) {
      if (!children[i])
        Fail(node, fmt::format("no branch for value \"{}\" of \"{}\"", v.values[i], v.name), "add an Edge");
      branch.children.push_back(*children[i]);
    }
    return table.Add(std::move(branch));
  }

  void RequireAll(const XMLElement& root) const {
    const auto require = [&](const std::vector<FactorTable>& tables, std::size_t variable, const char* section) {
      const FactorTable* first = nullptr;
      for (const FactorTable& table : tables) {
        if (table.target() != variable) continue;
        if (first != nullptr) {
          throw InputError(fmt::format("{}:{}", model_.name, table.line()),
                           fmt::format("a second table of \"{}\" in <{}>", model_.variables[variable].name, section),
                           "leave one out");
        }
        first = &table;
      }
      if (first == nullptr) {
        Fail(root, fmt::format("no table of \"{}\" in <{}>", model_.variables[variable].name, section), "give one");
      }
    };
    for (const FactoredPomdp::StateVariable& s : model_.states) {
      require(model_.initial, s.before, "InitialStateBelief");
      require(model_.transitions, s.after, "StateTransitionFunction");
    }
    for (const std::size_t o : model_.observations) require(model_.sensors, o, "ObsFunction");
  }

  static constexpr std::size_t kNumberWork = 50;  ///< of a number of a table
  FactoredPomdp& model_;
  Pulse& pulse_;
  std::map<std::string, std::size_t> index_;
  std::vector<std::map<std::string, std::uint32_t>> numbers_;
  std::vector<char> scope_of_;
  std::vector<std::string> reward_names_;
};

}  // namespace

Pomdp ParsePomdpx(std::string_view text, const std::string& name, const std::function<bool()>& stop) {
  Pulse pulse(stop);
  FactoredPomdp factored;
  factored.name = name;
  Reader(factored, pulse).Read(text);
  Pomdp pomdp = Join(factored, pulse);
  if (pomdp.discount < 1.0) return pomdp;
  pomdp.name = fmt::format("{}:{}", name, factored.discount_line);
  RequireSolvable(pomdp);
  pomdp.name = name;
  return pomdp;
}

}  // namespace feeler::planner
