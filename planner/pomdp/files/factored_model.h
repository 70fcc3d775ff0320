#pragma once

#include <string>
#include <vector>

#include "feeler/planner/pomdp/files/factor_table.h"
#include "feeler/planner/pomdp/model/pulse.h"

namespace feeler::planner {

/// A factored POMDP, as a `.pomdpx` file gives it. Variables are indices into `variables`.
struct FactoredPomdp {
  std::string name;
  double discount = 1.0;
  int discount_line = 1;
  std::vector<FactorVariable> variables;
  struct StateVariable {
    std::size_t before = 0, after = 0;
    bool observed = false;  ///< its value on arrival is part of the observation
  };
  std::vector<StateVariable> states;
  std::vector<std::size_t> actions, observations;
  std::vector<FactorTable> initial;      ///< one a state variable, target `before`
  std::vector<FactorTable> transitions;  ///< one a state variable, target `after`
  std::vector<FactorTable> sensors;      ///< one an observation variable
  std::vector<FactorTable> rewards;      ///< summed
};

/// The joint model of the states that can be met from the initial belief. Throws InputError at `NAME:LINE` of the table
/// whose probabilities do not sum to 1, or if the model would not fit.
Pomdp Join(const FactoredPomdp& factored, Pulse& pulse);

}  // namespace feeler::planner
