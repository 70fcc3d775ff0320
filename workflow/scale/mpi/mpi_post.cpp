#include "feeler/workflow/scale/mpi/mpi_post.h"

#define OMPI_SKIP_MPICXX 1
#define MPICH_SKIP_MPICXX 1
#include <mpi.h>

#include <iterator>
#include <limits>
#include <utility>

#include "feeler/core/error.h"

namespace feeler::workflow {

static_assert(sizeof(MPI_Request) <= sizeof(void*), "a request of MPI is kept as a pointer");

void MpiPost::Send(Message message) {
  if (message.bytes.size() > static_cast<std::size_t>(std::numeric_limits<int>::max())) {
    throw Error("ranks", "a message of more than 2 GB", "split the problem");
  }
  Sending& sending = sending_.emplace_back();
  sending.bytes = std::move(message.bytes);
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Isend(sending.bytes.data(), static_cast<int>(sending.bytes.size()), MPI_BYTE, message.rank,
            static_cast<int>(message.kind), MPI_COMM_WORLD, &request);
  sending.request = (void*)request;  // NOLINT: a pointer with OpenMPI, an int with MPICH
}

bool MpiPost::Receive(Message& message) {
  int there = 0;
  MPI_Status status;
  MPI_Iprobe(MPI_ANY_SOURCE, MPI_ANY_TAG, MPI_COMM_WORLD, &there, &status);
  if (there == 0) return false;
  int size = 0;
  MPI_Get_count(&status, MPI_BYTE, &size);
  message.kind = static_cast<MessageKind>(status.MPI_TAG);
  message.rank = status.MPI_SOURCE;
  message.bytes.resize(static_cast<std::size_t>(size));
  MPI_Recv(message.bytes.data(), size, MPI_BYTE, status.MPI_SOURCE, status.MPI_TAG, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
  return true;
}

bool MpiPost::Settle() {
  for (auto it = sending_.begin(); it != sending_.end();) {
    auto request = (MPI_Request)it->request;  // NOLINT
    int done = 0;
    MPI_Test(&request, &done, MPI_STATUS_IGNORE);
    it->request = (void*)request;  // NOLINT
    it = done != 0 ? sending_.erase(it) : std::next(it);
  }
  return sending_.empty();
}

}  // namespace feeler::workflow
