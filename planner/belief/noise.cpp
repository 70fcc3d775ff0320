#include "feeler/planner/belief/noise.h"

#include <fmt/format.h>

#include <cmath>

#include "feeler/core/error.h"

namespace feeler::planner {

void Validate(const Noise& noise, const std::string& where) {
  const auto probability = [&](const char* name, double value) {
    if (value >= 0.0 && value < 1.0) return;
    throw InputError(where, fmt::format("{} is {}, no probability below 1", name, value), "give a number in [0, 1)");
  };
  probability("missed_contact", noise.missed_contact);
  probability("false_stop", noise.false_stop);
  probability("slip", noise.slip);
  if (!(noise.missed_contact + noise.false_stop < 1.0)) {
    throw InputError(where,
                     fmt::format("missed_contact {} and false_stop {} leave contacts without information",
                                 noise.missed_contact, noise.false_stop),
                     "their sum must be below 1");
  }
  if (!(noise.false_stop + noise.slip < 1.0)) {
    throw InputError(where,
                     fmt::format("with false_stop {} and slip {} the tool never moves", noise.false_stop, noise.slip),
                     "their sum must be below 1");
  }
}

void Validate(const Declaration& declaration, const std::string& where) {
  if (!(declaration.confidence > 0.5 && declaration.confidence <= 1.0)) {
    throw InputError(where, fmt::format("confidence is {}, not in (0.5, 1]", declaration.confidence),
                     "0.99 declares at 99 percent");
  }
  if (!(declaration.wrong_cells > 0.0 && std::isfinite(declaration.wrong_cells))) {
    throw InputError(where, fmt::format("the cost of being wrong is {} cells", declaration.wrong_cells),
                     "give a number above 0");
  }
}

}  // namespace feeler::planner
