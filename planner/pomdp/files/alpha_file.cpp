#include "feeler/planner/pomdp/files/alpha_file.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <charconv>
#include <iterator>
#include <sstream>

#include "feeler/core/error.h"
#include "feeler/planner/pomdp/files/cassandra_tokens.h"

namespace feeler::planner {
namespace {

std::vector<double> InFull(const Pomdp& pomdp, const FullAlphaVector& alpha) {
  std::vector<double> values(pomdp.state_count(), alpha.elsewhere);
  for (const SparseEntry& s : alpha.values) values[s.index] = s.value;
  return values;
}

void RequireWritable(const Pomdp& pomdp, const std::vector<FullAlphaVector>& alphas) {
  const double bytes = 12.0 * static_cast<double>(pomdp.state_count()) * static_cast<double>(alphas.size());
  if (bytes <= 4e8) return;
  throw InputError(
      "--out",
      fmt::format("{} vectors of {} states would take {:.1f} GB", alphas.size(), pomdp.state_count(), bytes / 1e9),
      "write the policy as a graph: .json");
}

FullAlphaVector Vector(const Pomdp& pomdp, const std::string& where, double action, const std::vector<double>& values) {
  if (!(action >= 0.0) || action >= static_cast<double>(pomdp.action_count()) ||
      action != static_cast<double>(static_cast<std::uint32_t>(action))) {
    throw InputError(where, fmt::format("action {:g} of {}", action, pomdp.action_count()),
                     "is the policy of another model?");
  }
  if (values.size() != pomdp.state_count()) {
    throw InputError(where, fmt::format("{} values for {} states", values.size(), pomdp.state_count()),
                     "is the policy of another model?");
  }
  FullAlphaVector alpha{static_cast<std::uint32_t>(action), {}, 0.0};
  for (std::uint32_t s = 0; s < values.size(); ++s) alpha.values.push_back({s, values[s]});
  return alpha;
}

std::vector<double> Numbers(const std::string& where, const std::string& line) {
  std::istringstream in(line);
  std::vector<double> numbers;
  for (std::string word; in >> word;) {
    if (!CassandraTokens::IsNumber(word))
      throw InputError(where, fmt::format("\"{}\" is no number", word.substr(0, 40)), "give one");
    double value = 0.0;
    std::from_chars(word.data() + (word[0] == '+' ? 1 : 0), word.data() + word.size(), value);
    numbers.push_back(value);
  }
  return numbers;
}

}  // namespace

std::string FormatAlpha(const Pomdp& pomdp, const std::vector<FullAlphaVector>& alphas) {
  RequireWritable(pomdp, alphas);
  std::string text;
  for (const FullAlphaVector& alpha : alphas) {
    text += fmt::format("{}\n", alpha.action);
    for (const double value : InFull(pomdp, alpha)) fmt::format_to(std::back_inserter(text), "{:.17g} ", value);
    text += "\n\n";
  }
  return text;
}

std::string FormatPolicyx(const Pomdp& pomdp, const std::vector<FullAlphaVector>& alphas) {
  RequireWritable(pomdp, alphas);
  std::string text = fmt::format(
      "<?xml version=\"1.0\" encoding=\"ISO-8859-1\"?>\n<Policy version=\"0.1\" type=\"value\" model=\"{}\" "
      "xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" xsi:noNamespaceSchemaLocation=\"policyx.xsd\">\n"
      "<AlphaVector vectorLength=\"{}\" numObsValue=\"1\" numVectors=\"{}\">\n",
      "model", pomdp.state_count(), alphas.size());
  for (const FullAlphaVector& alpha : alphas) {
    text += fmt::format("<Vector action=\"{}\" obsValue=\"0\">", alpha.action);
    for (const double value : InFull(pomdp, alpha)) fmt::format_to(std::back_inserter(text), "{:.17g} ", value);
    text += "</Vector>\n";
  }
  return text + "</AlphaVector>\n</Policy>\n";
}

std::vector<FullAlphaVector> ParseAlpha(std::string_view text, const std::string& name, const Pomdp& pomdp) {
  std::vector<FullAlphaVector> alphas;
  std::istringstream lines{std::string(text)};
  int number = 0;
  double action = -1.0;
  for (std::string line; std::getline(lines, line);) {
    const std::string where = fmt::format("{}:{}", name, ++number);
    const std::vector<double> numbers = Numbers(where, line);
    if (numbers.empty()) continue;
    if (action < 0.0) {
      if (numbers.size() != 1 || numbers[0] < 0.0)
        throw InputError(where, "the number of an action should stand here alone", "see docs/pomdp.md");
      action = numbers[0];
    } else {
      alphas.push_back(Vector(pomdp, where, action, numbers));
      action = -1.0;
    }
  }
  if (action >= 0.0)
    throw InputError(fmt::format("{}:{}", name, number), "the file ends where values should be",
                     "is the file complete?");
  if (alphas.empty()) throw InputError(name, "no vectors", "give at least one");
  return alphas;
}

std::vector<FullAlphaVector> ParsePolicyx(std::string_view text, const std::string& name, const Pomdp& pomdp) {
  tinyxml2::XMLDocument document;
  if (document.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS) {
    throw InputError(fmt::format("{}:{}", name, document.ErrorLineNum()),
                     fmt::format("no complete XML ({})", document.ErrorName()), "is the file complete?");
  }
  const tinyxml2::XMLElement* root = document.RootElement();
  const tinyxml2::XMLElement* list = root == nullptr ? nullptr : root->FirstChildElement("AlphaVector");
  if (list == nullptr) throw InputError(name, "no <AlphaVector>", "give a policyx file");
  if (list->IntAttribute("numObsValue", 1) != 1) {
    throw InputError(fmt::format("{}:{}", name, list->GetLineNum()), "vectors by observed value",
                     "only policies over all states are read");
  }
  std::vector<FullAlphaVector> alphas;
  for (const auto* v = list->FirstChildElement("Vector"); v != nullptr; v = v->NextSiblingElement("Vector")) {
    const std::string where = fmt::format("{}:{}", name, v->GetLineNum());
    alphas.push_back(Vector(pomdp, where, v->DoubleAttribute("action", -1.0),
                            Numbers(where, v->GetText() == nullptr ? "" : v->GetText())));
  }
  if (alphas.empty()) throw InputError(name, "no vectors", "give at least one");
  return alphas;
}

}  // namespace feeler::planner
