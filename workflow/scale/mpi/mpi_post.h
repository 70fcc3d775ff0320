#pragma once

#include <list>
#include <string>

namespace feeler::workflow {

/// What a message is about.
enum class MessageKind : int { kGreeting = 1, kWelcome, kRequest, kAnswer, kFailure, kCancel, kEnd, kGoodbye };

struct Message {
  MessageKind kind = MessageKind::kEnd;
  int rank = 0;  ///< where it comes from or goes to
  std::string bytes;
};

/// Messages of any size between ranks over MPI_COMM_WORLD, none of whose calls waits. One thread at a time.
class MpiPost {
 public:
  MpiPost() = default;
  MpiPost(const MpiPost&) = delete;
  MpiPost& operator=(const MpiPost&) = delete;

  void Send(Message message);
  /// False if no message has come.
  bool Receive(Message& message);
  /// Lets go of what has been sent. True if nothing is on its way any more.
  bool Settle();

 private:
  struct Sending {
    std::string bytes;
    void* request = nullptr;  ///< MPI_Request
  };
  std::list<Sending> sending_;
};

}  // namespace feeler::workflow
