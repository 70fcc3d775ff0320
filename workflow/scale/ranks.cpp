#include "feeler/workflow/scale/ranks.h"

#include <cstdlib>

namespace feeler::workflow {
namespace {

/// The first variable that is set; `fallback` without one.
int FirstOf(const char* open_mpi, const char* mpich, int fallback) {
  for (const char* name : {open_mpi, mpich}) {
    if (const char* text = std::getenv(name)) return std::atoi(text);  // NOLINT(cert-err34-c): the launcher's own
  }
  return fallback;
}

}  // namespace

int LaunchedRanks() { return FirstOf("OMPI_COMM_WORLD_SIZE", "PMI_SIZE", 1); }

int LaunchedOnHost() { return FirstOf("OMPI_COMM_WORLD_LOCAL_SIZE", "MPI_LOCALNRANKS", 1); }

int LaunchedRank() { return FirstOf("OMPI_COMM_WORLD_RANK", "PMI_RANK", 0); }

}  // namespace feeler::workflow
