#pragma once

#include <deque>
#include <mutex>
#include <string>

#include "feeler/core/random.h"
#include "feeler/execution/remote/socket.h"

namespace feeler::execution {

/// One end of a connection, with what a network does to lines: each takes `latency_s`, and up to `jitter_s` more, in
/// either direction; their order is kept. One thread may receive while others send.
class Link {
 public:
  Link(Connection connection, double latency_s, double jitter_s, RandomStream random);

  /// The next line that has arrived; waits at most `timeout_s`.
  LineStatus Receive(std::string& line, double timeout_s, std::size_t most_bytes);
  /// False if the other end is gone.
  bool Send(const std::string& line);
  /// Sends these bytes as they are, without an end of line (half a message).
  void SendRaw(const std::string& bytes);
  /// Lets what is under way arrive, then closes.
  void Close();
  /// Closes at once: what is under way is lost.
  void Cut();
  bool open() const { return connection_.open(); }

 private:
  struct Timed {
    double at_s;
    std::string line;
  };
  double Delay(double last_s);
  void Flush();
  double NextRelease();

  Connection connection_;
  double latency_s_;
  double jitter_s_;
  RandomStream random_;
  std::deque<Timed> inbox_;
  bool closed_ = false;  ///< the other end sends no more
  bool too_long_ = false;
  std::recursive_mutex sending_;  ///< of what follows, and of writing to and closing the connection
  std::deque<Timed> outbox_;
  bool writable_ = true;
};

}  // namespace feeler::execution
