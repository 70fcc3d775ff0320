#include "feeler/policies/io/pomdp_export.h"

#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <map>
#include <vector>

#include "feeler/core/error.h"
#include "feeler/planner/solve.h"
#include "feeler/policies/io/pomdp_model.h"

namespace feeler::policies {
namespace {

using fmt::format_to;

/// Largest file that is written, and the steps beyond which it cannot be smaller (a step takes 40 bytes and more).
/// No transition is written in fewer.
constexpr std::size_t kBytesPerStep = 40;

/// To be asked while the text grows.
void RequireSize(const planner::Problem& problem, const PomdpOptions& options, const std::string& text) {
  if (text.size() <= options.max_bytes) return;
  throw InputError(problem.name.empty() ? "problem" : problem.name,
                   fmt::format("takes more than {} MB", options.max_bytes / 1'000'000), "export a smaller problem");
}

/// A bound below the optimal cost would make wrong declarations pay: the exported problem would be another one.
void RequireUpperBound(const planner::Problem& problem, double upper_bound) {
  constexpr double kTolerance = 1e-9;  // relative: of sums in another order
  constexpr std::int64_t kExpansions = 20'000;
  planner::SolverOptions options = planner::FastSetting(planner::SolverKind::kCertified, 1.0);
  options.gap = 1.0;
  options.expansion_limit = kExpansions;
  const planner::SolverResult result = planner::Solve(problem, options);
  if (result.status == planner::SolverStatus::kUnlocalizable) return;  // refused where the model is made
  if (upper_bound >= result.lower_bound * (1.0 - kTolerance)) return;
  throw InputError(
      "upper bound",
      fmt::format("{} is below the optimal cost, which is at least {:.6g}", upper_bound, result.lower_bound),
      "give the expected cost of a complete policy (feeler solve)");
}

PomdpModel MakeModel(const planner::Problem& problem, const PomdpOptions& options) {
  if (!(options.discount > 0.0 && options.discount <= 1.0)) {
    throw InputError("discount", fmt::format("is {}, not in (0, 1]", options.discount), "1 keeps the problem exact");
  }
  if (!(options.upper_bound >= 0.0)) {
    throw InputError("upper bound", fmt::format("is {}", options.upper_bound), "give the cost of a policy");
  }
  if (std::isfinite(options.upper_bound)) RequireUpperBound(problem, options.upper_bound);
  return MakePomdpModel(problem, options.upper_bound, options.max_bytes / kBytesPerStep);
}

/// A decimal number with digits on both sides of the point, as Cassandra's format wants them, that reads back exactly.
std::string Decimal(double value) {
  std::string text = fmt::format("{}", value);
  if (text.find_first_of("eE") != std::string::npos) text = fmt::format("{:.20f}", value);
  return text.find('.') == std::string::npos ? text + ".0" : text;
}

std::string Comment(const planner::Problem& problem, const PomdpModel& model) {
  std::string name;
  for (const char c : problem.name) name += c >= ' ' && c != '-' && c != '<' && c != '>' && c != '&' ? c : '_';
  return fmt::format(
      "{}: {} robot cells, {} hypotheses. Wrong declaration or move without room: {}. "
      "The negated value is the least cost of a policy that reaches done",
      name, model.cells.size(), model.prior.size(), Decimal(model.penalty));
}

bool Contains(const std::vector<int>& set, std::size_t h) {
  for (const int member : set) {
    if (member == static_cast<int>(h)) return true;
  }
  return false;
}

/// How a table over hypotheses is written: one line if all agree, else one line each.
template <typename Value, typename Write>
void ForEachDistinct(std::size_t hypotheses, const Value& value, const Write& write) {
  bool same = true;
  for (std::size_t h = 1; h < hypotheses; ++h) same = same && value(h) == value(0);
  if (same) return write("*", value(0));
  for (std::size_t h = 0; h < hypotheses; ++h) write(fmt::format("h{}", h), value(h));
}

std::string Entry(const std::string& instance, const char* table, const std::string& value) {
  return fmt::format("    <Entry><Instance>{}</Instance><{}>{}</{}></Entry>\n", instance, table, value, table);
}

}  // namespace

double DeclarePenalty(const planner::Problem& problem, const PomdpOptions& options) {
  return MakeModel(problem, options).penalty;
}

std::string FormatPomdp(const planner::Problem& problem, const PomdpOptions& options) {
  const PomdpModel model = MakeModel(problem, options);
  const std::size_t cells = model.cells.size();
  const std::size_t hypotheses = model.prior.size();
  std::string text;
  const auto out = std::back_inserter(text);
  std::vector<std::string> cell_names;
  for (std::size_t r = 0; r < cells; ++r) cell_names.push_back(model.CellName(r));
  const auto state = [&](std::size_t r, std::size_t h) { return fmt::format("{}_h{}", cell_names[r], h); };

  format_to(out, "# {}\n", Comment(problem, model));
  format_to(out, "discount: {}\nvalues: reward\nstates:", Decimal(options.discount));
  for (std::size_t r = 0; r < cells; ++r) {
    for (std::size_t h = 0; h < hypotheses; ++h) format_to(out, " {}", state(r, h));
  }
  text += " done\nactions:";
  for (std::size_t m = 0; m < model.moves.size(); ++m) format_to(out, " {}", model.MoveName(m));
  for (std::size_t d = 0; d < model.declarations.size(); ++d) format_to(out, " {}", model.DeclarationName(d));
  text += "\nobservations:";
  for (const std::string& name : cell_names) format_to(out, " {}", name);
  text += " end\nstart:";
  for (std::size_t r = 0; r < cells; ++r) {
    for (std::size_t h = 0; h < hypotheses; ++h) text += r == 0 ? " " + Decimal(model.prior[h]) : " 0.0";
  }
  text += " 0.0\n\n";

  for (std::size_t m = 0; m < model.moves.size(); ++m) {
    const std::string name = model.MoveName(m);
    for (std::size_t r = 0; r < cells; ++r) {
      RequireSize(problem, options, text);
      for (std::size_t h = 0; h < hypotheses; ++h) {
        const PomdpModel::Step& step = model.At(m, r, h);
        format_to(out, "T: {} : {} : {} 1.0\n", name, state(r, h), state(static_cast<std::size_t>(step.cell), h));
        if (step.cost != 0.0) format_to(out, "R: {} : {} : * : * {}\n", name, state(r, h), Decimal(-step.cost));
      }
    }
    format_to(out, "T: {} : done : done 1.0\n", name);
  }
  for (std::size_t d = 0; d < model.declarations.size(); ++d) {
    const std::string name = model.DeclarationName(d);
    format_to(out, "T: {} : * : done 1.0\n", name);
    for (std::size_t r = 0; r < cells; ++r) {
      RequireSize(problem, options, text);
      for (std::size_t h = 0; h < hypotheses; ++h) {
        if (Contains(model.declarations[d], h)) continue;
        format_to(out, "R: {} : {} : * : * {}\n", name, state(r, h), Decimal(-model.penalty));
      }
    }
  }
  for (std::size_t r = 0; r < cells; ++r) {
    for (std::size_t h = 0; h < hypotheses; ++h) format_to(out, "O: * : {} : {} 1.0\n", state(r, h), cell_names[r]);
  }
  text += "O: * : done : end 1.0\n";
  RequireSize(problem, options, text);
  return text;
}

std::string FormatPomdpx(const planner::Problem& problem, const PomdpOptions& options) {
  const PomdpModel model = MakeModel(problem, options);
  const std::size_t cells = model.cells.size();
  const std::size_t hypotheses = model.prior.size();
  std::string text;
  const auto out = std::back_inserter(text);
  std::string cell_names;
  std::string start_cell;
  std::string hypothesis_names;
  std::string prior;
  std::string action_names;
  for (std::size_t r = 0; r < cells; ++r) {
    cell_names += model.CellName(r) + " ";
    start_cell += r == 0 ? "1.0 " : "0.0 ";
  }
  for (std::size_t h = 0; h < hypotheses; ++h) {
    hypothesis_names += fmt::format("{}h{}", h == 0 ? "" : " ", h);
    prior += (h == 0 ? "" : " ") + Decimal(model.prior[h]);
  }
  for (std::size_t m = 0; m < model.moves.size(); ++m) action_names += model.MoveName(m) + " ";
  for (std::size_t d = 0; d < model.declarations.size(); ++d) action_names += model.DeclarationName(d) + " ";
  if (!action_names.empty()) action_names.pop_back();

  text += "<?xml version=\"1.0\" encoding=\"ISO-8859-1\"?>\n";
  text +=
      "<pomdpx version=\"1.0\" id=\"feeler\" xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" "
      "xsi:noNamespaceSchemaLocation=\"pomdpx.xsd\">\n";
  std::string comment = Comment(problem, model);
  for (char& c : comment) c = static_cast<unsigned char>(c) < 128 ? c : '_';
  format_to(out, " <Description>{}</Description>\n <Discount>{}</Discount>\n", comment, Decimal(options.discount));
  text += " <Variable>\n  <StateVar vnamePrev=\"robot_0\" vnameCurr=\"robot_1\" fullyObs=\"true\">\n";
  format_to(out, "   <ValueEnum>{}done</ValueEnum>\n  </StateVar>\n", cell_names);
  text += "  <StateVar vnamePrev=\"target_0\" vnameCurr=\"target_1\">\n";
  format_to(out, "   <ValueEnum>{}</ValueEnum>\n  </StateVar>\n", hypothesis_names);
  text += "  <ObsVar vname=\"nothing\"><ValueEnum>none</ValueEnum></ObsVar>\n";
  format_to(out, "  <ActionVar vname=\"action\"><ValueEnum>{}</ValueEnum></ActionVar>\n", action_names);
  text += "  <RewardVar vname=\"reward\"/>\n </Variable>\n <InitialStateBelief>\n";
  const auto initial = [&](const char* variable, const std::string& table) {
    format_to(out,
              "  <CondProb><Var>{}</Var><Parent>null</Parent><Parameter type=\"TBL\">\n{}  </Parameter></CondProb>\n",
              variable, Entry("-", "ProbTable", table));
  };
  initial("robot_0", start_cell + "0.0");
  initial("target_0", prior);
  text += " </InitialStateBelief>\n <StateTransitionFunction>\n";
  text += "  <CondProb><Var>robot_1</Var><Parent>action robot_0 target_0</Parent><Parameter type=\"TBL\">\n";
  text += Entry("* done * done", "ProbTable", "1.0");
  for (std::size_t m = 0; m < model.moves.size(); ++m) {
    for (std::size_t r = 0; r < cells; ++r) {
      RequireSize(problem, options, text);
      ForEachDistinct(
          hypotheses, [&](std::size_t h) { return model.At(m, r, h).cell; },
          [&](const std::string& h, int next) {
            text += Entry(fmt::format("{} {} {} {}", model.MoveName(m), model.CellName(r), h,
                                      model.CellName(static_cast<std::size_t>(next))),
                          "ProbTable", "1.0");
          });
    }
  }
  for (std::size_t d = 0; d < model.declarations.size(); ++d) {
    text += Entry(model.DeclarationName(d) + " * * done", "ProbTable", "1.0");
  }
  text += "  </Parameter></CondProb>\n";
  text += "  <CondProb><Var>target_1</Var><Parent>target_0</Parent><Parameter type=\"TBL\">\n";
  text += Entry("- -", "ProbTable", "identity");
  text += "  </Parameter></CondProb>\n </StateTransitionFunction>\n <ObsFunction>\n";
  text += "  <CondProb><Var>nothing</Var><Parent>action robot_1 target_1</Parent><Parameter type=\"TBL\">\n";
  text += Entry("* * * none", "ProbTable", "1.0");
  text += "  </Parameter></CondProb>\n </ObsFunction>\n <RewardFunction>\n";
  text += "  <Func><Var>reward</Var><Parent>action robot_0 target_0</Parent><Parameter type=\"TBL\">\n";
  for (std::size_t m = 0; m < model.moves.size(); ++m) {
    for (std::size_t r = 0; r < cells; ++r) {
      RequireSize(problem, options, text);
      ForEachDistinct(
          hypotheses, [&](std::size_t h) { return model.At(m, r, h).cost; },
          [&](const std::string& h, double cost) {
            if (cost == 0.0) return;
            text +=
                Entry(fmt::format("{} {} {}", model.MoveName(m), model.CellName(r), h), "ValueTable", Decimal(-cost));
          });
    }
  }
  for (std::size_t d = 0; d < model.declarations.size(); ++d) {
    for (std::size_t h = 0; h < hypotheses; ++h) {
      if (Contains(model.declarations[d], h)) continue;
      const std::string name = model.DeclarationName(d);
      text += Entry(fmt::format("{} * h{}", name, h), "ValueTable", Decimal(-model.penalty));
      text += Entry(fmt::format("{} done h{}", name, h), "ValueTable", "0.0");  // a later entry overrides
    }
  }
  text += "  </Parameter></Func>\n </RewardFunction>\n</pomdpx>\n";
  return text;
}

}  // namespace feeler::policies
