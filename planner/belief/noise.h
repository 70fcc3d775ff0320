#pragma once

#include <string>

namespace feeler::planner {

/// How the readings of single steps are wrong, each with a probability of its own, whatever was read before. A blocked
/// step reports contact, or (missed_contact) does not: then the tool stays and the move goes on. A free step advances,
/// or ends the move with a false contact (false_stop), or is spent while the tool stays (slip).
struct Noise {
  double missed_contact = 0.0;
  double false_stop = 0.0;
  double slip = 0.0;
  bool any() const { return missed_contact > 0.0 || false_stop > 0.0 || slip > 0.0; }
  bool operator==(const Noise&) const = default;
};

/// When a policy may declare where the target is, and what it pays where that is wrong.
struct Declaration {
  /// In (0.5, 1]: a declaration needs so much probability.
  double confidence = 0.99;
  /// > 0; in cells (of the least cost per cell; in actions where cells cost nothing).
  double wrong_cells = 100.0;
  bool operator==(const Declaration&) const = default;
};

/// Throws InputError at `where` unless all are probabilities below 1, missed_contact + false_stop < 1 (else contacts
/// say nothing) and false_stop + slip < 1 (else the tool never moves).
void Validate(const Noise& noise, const std::string& where);
/// Throws InputError at `where` for a confidence outside (0.5, 1] or a cost that is not positive and finite.
void Validate(const Declaration& declaration, const std::string& where);

}  // namespace feeler::planner
