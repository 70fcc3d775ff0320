#pragma once

#include <stdexcept>
#include <string>

namespace feeler {

/// Base of all errors that reach a user. `what()` is `WHERE: WHAT (HOW TO MEND)` on one line.
class Error : public std::runtime_error {
 public:
  Error(const std::string& where, const std::string& what, const std::string& mend = "");
};

/// Bad usage or bad input; the command line exits with 2.
class InputError : public Error {
 public:
  using Error::Error;
};

/// The work ran and its answer is no (nothing found, verification failed); the command line exits with 1.
class NegativeResult : public Error {
 public:
  using Error::Error;
};

/// The simulated or real world failed while it was used (unstable physics, a full contact buffer).
class WorldError : public Error {
 public:
  using Error::Error;
};

}  // namespace feeler
