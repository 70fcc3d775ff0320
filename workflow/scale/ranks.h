#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "feeler/core/progress.h"

namespace feeler::workflow {

/// What a rank did.
struct RankAccount {
  int rank = 0;
  std::string host;
  std::int64_t done = 0;  ///< pieces of work
  double cpu_s = 0.0;     ///< of its process
};

/// The processes of one job, perhaps on several machines, that were started together (mpirun, srun). Rank 0 holds the
/// files and gives the work out, the others serve it. Laws:
///   - a request is handled exactly once, on one thread of one rank, and its answer comes back whole;
///   - an error of a rank is thrown on rank 0, once;
///   - a rank that waits sleeps;
///   - a cancellation of rank 0 cancels all; what is not answered a second later is given up.
/// A rank that dies takes the job with it (the launcher ends the others).
class Ranks {
 public:
  using Handler = std::function<std::string(const std::string& request)>;

  virtual ~Ranks() = default;
  virtual int rank() const = 0;
  virtual int size() const = 0;

  /// Rank 0: waits for the others and compares their identities with this one, a JSON object of what must be equal on
  /// all. Throws Error for a rank that failed, InputError for one that differs, naming rank, host and what.
  virtual void Assemble(const std::string& identity) = 0;
  /// Rank 0, assembled: how many calls may be open at once to have every thread of the other ranks at work on so many
  /// pieces, the next piece at hand.
  virtual int LanesFor(std::size_t pieces) const = 0;
  /// Rank 0: has a rank handle the request; `lane` below LanesFor says which. Any thread, one call a lane at a time.
  /// Throws Interrupted after a cancellation, Error for what the handler threw.
  virtual std::string Call(int lane, const std::string& request) = 0;
  /// Rank 0: what has been done so far, a line a rank; that of rank 0 has no pieces.
  virtual std::vector<RankAccount> Accounts() const = 0;

  /// Other ranks: handles requests on so many threads, each with a handler of its own, until rank 0 is done.
  virtual void Serve(const std::string& identity, int threads, const std::function<Handler()>& make_handler) = 0;
  /// Other ranks: an error before Serve, or of it, for rank 0 to tell.
  virtual void Fail(const std::string& message, int exit_code) = 0;
};

/// How many processes the launcher of this one says it started together; 1 without a launcher.
int LaunchedRanks();
/// Which of them this one is.
int LaunchedRank();
/// How many of them are on this host, as the launcher says; 1 where it does not.
int LaunchedOnHost();

}  // namespace feeler::workflow
