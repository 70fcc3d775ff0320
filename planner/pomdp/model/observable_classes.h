#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "feeler/planner/pomdp/model/pomdp.h"

namespace feeler::planner {

/// What an action and an observation do to a belief of a class.
struct ClassOutcome {
  struct Step {
    std::uint32_t from = 0, to = 0;  ///< positions in the states of this class and of the next
    double probability = 0.0;        ///< P(s', o | s, a)
  };
  std::uint32_t observation = 0;
  std::uint32_t next = 0;  ///< class of the successor
  std::vector<Step> steps;
};

/// States that are told apart by what has been observed are in different classes: every belief that can be met, except
/// for the initial one, lies within one class. Found from the model (the mixed observability of Ong, Png, Hsu and Lee
/// 2010 without its declaration): whatever the states of a class can become by one action and one observation is in one
/// class. Value functions are kept a class, so that the work on a belief grows with its class, not with all states.
struct ObservableClasses {
  struct Class {
    std::vector<std::uint32_t> states;                ///< ascending
    std::vector<std::vector<ClassOutcome>> outcomes;  ///< by action
  };
  std::vector<Class> classes;
  std::uint32_t start_class = 0;
  std::vector<SparseEntry> start;  ///< the initial belief, by position in its class
};

/// Nothing if `stop` (asked now and then, may be empty) cuts it short.
std::optional<ObservableClasses> FindObservableClasses(const Pomdp& pomdp, const std::function<bool()>& stop = {});

/// What the outcomes of all classes will take.
double OutcomeBytes(const Pomdp& pomdp);

}  // namespace feeler::planner
