#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "feeler/core/progress.h"

namespace feeler::execution {

/// Longest frame that either end takes, in bytes: a picture is the longest sound one.
inline constexpr std::size_t kMostFrameBytes = std::size_t{16} << 20;
/// Longest frame that a robot takes: requests are short.
inline constexpr std::size_t kMostRequestBytes = std::size_t{1} << 18;

/// "127.0.0.1:7800", "[::1]:7800", "cell-3:7800".
struct Address {
  std::string host;
  int port = 0;  ///< 0 to listen on: any free one
};
/// Throws InputError naming `option`.
Address ParseAddress(const std::string& option, const std::string& text);
/// 127.0.0.0/8, ::1 and "localhost": what only this machine reaches.
bool IsLoopback(const Address& address);

/// How waiting for a line ended.
enum class LineStatus { kLine, kTimeout, kClosed, kTooLong };

/// A connected TCP socket that carries lines. Not thread-safe, but that one thread may read while another writes.
class Connection {
 public:
  explicit Connection(int descriptor);
  ~Connection();
  Connection(Connection&& other) noexcept;
  Connection& operator=(Connection&& other) noexcept;

  /// The next line, without its end. Waits at most `timeout_s` (0: takes only what has come, infinite: for ever).
  LineStatus ReadLine(std::string& line, double timeout_s, std::size_t most_bytes = kMostFrameBytes);
  /// Whether a line can be had without waiting.
  bool HasLine() const { return buffer_.find('\n', scanned_) != std::string::npos; }
  /// Writes all of it. False if the other end is gone, or takes nothing for `timeout_s`.
  bool Write(std::string_view bytes, double timeout_s = 2.0);
  /// Says no more, and takes what still comes for a moment: closing with bytes unread would lose the last words.
  void Finish();
  /// Ends both directions at once; whoever waits to read is told kClosed.
  void Shutdown();
  void Close();
  bool open() const { return descriptor_ >= 0; }
  int descriptor() const { return descriptor_; }

 private:
  bool TakeLine(std::string& line);

  int descriptor_ = -1;
  bool ended_ = false;  ///< the other end sends no more
  std::string buffer_;
  std::size_t begin_ = 0;    ///< of what has not been taken
  std::size_t scanned_ = 0;  ///< no line end before this
};

/// Throws WorldError when nobody answers there, or the wait is cancelled.
Connection Connect(const Address& address, double timeout_s, const CancellationToken* cancellation = nullptr);

class Listener {
 public:
  /// Throws InputError naming `option` if the address cannot be had.
  Listener(const std::string& option, const Address& address);
  ~Listener();
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  /// Empty if nobody comes within `timeout_s`.
  std::optional<Connection> Accept(double timeout_s);
  /// The port in use.
  int port() const { return port_; }

 private:
  int descriptor_ = -1;
  int port_ = 0;
};

/// Seconds on a clock that never goes back.
double MonotonicSeconds();

}  // namespace feeler::execution
