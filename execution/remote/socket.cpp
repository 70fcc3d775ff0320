#include "feeler/execution/remote/socket.h"

#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <ctime>
#include <memory>
#include <utility>

#include "feeler/core/error.h"

namespace feeler::execution {
namespace {

/// Waits until the descriptor is ready. False after `timeout_s`.
bool WaitFor(int descriptor, short events, double timeout_s) {
  const double end_s = MonotonicSeconds() + timeout_s;
  for (;;) {
    const double left_s = std::max(0.0, end_s - MonotonicSeconds());
    timespec wait{};
    const bool for_ever = !std::isfinite(left_s) || left_s > 1e6;
    wait.tv_sec = for_ever ? 0 : static_cast<time_t>(left_s);
    wait.tv_nsec = for_ever ? 0 : static_cast<long>((left_s - std::floor(left_s)) * 1e9);
    pollfd entry{descriptor, events, 0};
    const int ready = ppoll(&entry, 1, for_ever ? nullptr : &wait, nullptr);
    if (ready > 0) return true;
    if (ready == 0) return false;
    if (errno != EINTR) return true;  // let the call that follows say what is wrong
    if (MonotonicSeconds() >= end_s) return false;
  }
}

void MakeNimble(int descriptor) {
  const int on = 1;
  setsockopt(descriptor, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  fcntl(descriptor, F_SETFL, fcntl(descriptor, F_GETFL) | O_NONBLOCK);
  fcntl(descriptor, F_SETFD, FD_CLOEXEC);
}

using AddressList = std::unique_ptr<addrinfo, decltype(&freeaddrinfo)>;

AddressList Resolve(const Address& address, bool to_listen) {
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_NUMERICSERV | (to_listen ? AI_PASSIVE : 0);
  addrinfo* list = nullptr;
  const int failed = getaddrinfo(address.host.c_str(), std::to_string(address.port).c_str(), &hints, &list);
  return {failed == 0 ? list : nullptr, &freeaddrinfo};
}

}  // namespace

double MonotonicSeconds() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

Address ParseAddress(const std::string& option, const std::string& text) {
  const std::size_t colon = text.rfind(':');
  Address address;
  const char* mend = "give HOST:PORT, e.g. 127.0.0.1:7800";
  if (colon == std::string::npos || colon == 0) throw InputError(option, "'" + text + "' is no address", mend);
  address.host = text.substr(0, colon);
  if (address.host.front() == '[' && address.host.back() == ']') {
    address.host = address.host.substr(1, address.host.size() - 2);
  }
  const char* first = text.data() + colon + 1;
  const char* last = text.data() + text.size();
  const auto [end, error] = std::from_chars(first, last, address.port);
  if (error != std::errc() || end != last || first == last || address.port < 0 || address.port > 65535) {
    throw InputError(option, "'" + text + "' has no port of 0 to 65535", mend);
  }
  return address;
}

bool IsLoopback(const Address& address) {
  return address.host.starts_with("127.") || address.host == "::1" || address.host == "localhost";
}

Connection::Connection(int descriptor) : descriptor_(descriptor) { MakeNimble(descriptor); }

Connection::~Connection() { Close(); }

Connection::Connection(Connection&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)),
      ended_(other.ended_),
      buffer_(std::move(other.buffer_)),
      begin_(other.begin_),
      scanned_(other.scanned_) {}

Connection& Connection::operator=(Connection&& other) noexcept {
  if (this == &other) return *this;
  Close();
  descriptor_ = std::exchange(other.descriptor_, -1);
  ended_ = other.ended_;
  buffer_ = std::move(other.buffer_);
  begin_ = other.begin_;
  scanned_ = other.scanned_;
  return *this;
}

void Connection::Close() {
  if (descriptor_ >= 0) close(descriptor_);
  descriptor_ = -1;
}

void Connection::Shutdown() {
  if (descriptor_ >= 0) shutdown(descriptor_, SHUT_RDWR);
}

void Connection::Finish() {
  if (descriptor_ < 0) return;
  constexpr double kMoment_s = 0.05;
  shutdown(descriptor_, SHUT_WR);
  const double end_s = MonotonicSeconds() + kMoment_s;
  std::array<char, 16384> bytes{};
  while (MonotonicSeconds() < end_s) {
    const ssize_t got = recv(descriptor_, bytes.data(), bytes.size(), 0);
    if (got == 0 || (got < 0 && errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR)) break;
    if (got < 0) WaitFor(descriptor_, POLLIN, end_s - MonotonicSeconds());
  }
}

bool Connection::TakeLine(std::string& line) {
  const std::size_t end = buffer_.find('\n', scanned_);
  if (end == std::string::npos) {
    scanned_ = buffer_.size();
    return false;
  }
  std::size_t length = end - begin_;
  if (length > 0 && buffer_[end - 1] == '\r') --length;
  line.assign(buffer_, begin_, length);
  begin_ = scanned_ = end + 1;
  if (begin_ == buffer_.size()) {
    buffer_.clear();
    begin_ = scanned_ = 0;
  } else if (begin_ > std::size_t{1} << 16) {
    buffer_.erase(0, begin_);
    begin_ = scanned_ = 0;
  }
  return true;
}

LineStatus Connection::ReadLine(std::string& line, double timeout_s, std::size_t most_bytes) {
  const double end_s = MonotonicSeconds() + timeout_s;
  for (;;) {
    if (TakeLine(line)) return line.size() > most_bytes ? LineStatus::kTooLong : LineStatus::kLine;
    if (buffer_.size() - begin_ > most_bytes) return LineStatus::kTooLong;
    if (ended_ || descriptor_ < 0) return LineStatus::kClosed;
    std::array<char, 16384> bytes{};
    const ssize_t got = recv(descriptor_, bytes.data(), bytes.size(), 0);
    if (got > 0) {
      buffer_.append(bytes.data(), static_cast<std::size_t>(got));
      continue;
    }
    if (got == 0) {
      ended_ = true;
      continue;
    }
    if (errno == EINTR) continue;
    if (errno != EAGAIN && errno != EWOULDBLOCK) {
      ended_ = true;
      continue;
    }
    const double left_s = timeout_s > 0.0 ? end_s - MonotonicSeconds() : 0.0;
    if (!(left_s > 0.0) || !WaitFor(descriptor_, POLLIN, left_s)) return LineStatus::kTimeout;
  }
}

bool Connection::Write(std::string_view bytes, double timeout_s) {
  while (!bytes.empty()) {
    if (descriptor_ < 0) return false;
    const ssize_t sent = send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent >= 0) {
      bytes.remove_prefix(static_cast<std::size_t>(sent));
      continue;
    }
    if (errno == EINTR) continue;
    if (errno != EAGAIN && errno != EWOULDBLOCK) return false;
    if (!WaitFor(descriptor_, POLLOUT, timeout_s)) return false;
  }
  return true;
}

Connection Connect(const Address& address, double timeout_s, const CancellationToken* cancellation) {
  const std::string where = address.host + ":" + std::to_string(address.port);
  const AddressList list = Resolve(address, false);
  if (!list) throw WorldError(where, "no such host", "check the address of the robot");
  const double end_s = MonotonicSeconds() + timeout_s;
  int error = 0;
  constexpr double kLookAtCancellation_s = 0.1;
  const auto cancelled = [&] { return cancellation != nullptr && cancellation->cancelled(); };
  const auto answered = [&](int descriptor) {
    bool ready = false;
    while (!ready && !cancelled() && MonotonicSeconds() < end_s) {
      ready = WaitFor(descriptor, POLLOUT, std::clamp(end_s - MonotonicSeconds(), 0.0, kLookAtCancellation_s));
    }
    return ready;
  };
  do {  // a robot that is about to listen is waited for
    for (const addrinfo* at = list.get(); at != nullptr; at = at->ai_next) {
      const int descriptor = socket(at->ai_family, at->ai_socktype, at->ai_protocol);
      if (descriptor < 0) continue;
      Connection connection(descriptor);
      error = connect(descriptor, at->ai_addr, at->ai_addrlen) == 0 ? 0 : errno;
      if (error == EINPROGRESS && answered(descriptor)) {
        socklen_t size = sizeof error;
        getsockopt(descriptor, SOL_SOCKET, SO_ERROR, &error, &size);
      }
      if (error == 0) return connection;
    }
    usleep(20'000);
  } while (MonotonicSeconds() < end_s && !cancelled());
  if (cancelled()) throw WorldError(where, "nobody answered before it was interrupted", "begin again");
  throw WorldError(where, std::string("no robot answers: ") + std::strerror(error),
                   "start it (feeler simulate --listen ADDR) or check the address");
}

Listener::Listener(const std::string& option, const Address& address) {
  const std::string where = address.host + ":" + std::to_string(address.port);
  const AddressList list = Resolve(address, true);
  if (!list) throw InputError(option, "'" + where + "' is no address of this machine", "e.g. 127.0.0.1:7800");
  int error = 0;
  for (const addrinfo* at = list.get(); at != nullptr; at = at->ai_next) {
    descriptor_ = socket(at->ai_family, at->ai_socktype, at->ai_protocol);
    if (descriptor_ < 0) continue;
    const int on = 1;
    setsockopt(descriptor_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    MakeNimble(descriptor_);
    if (bind(descriptor_, at->ai_addr, at->ai_addrlen) == 0 && listen(descriptor_, 8) == 0) break;
    error = errno;
    close(descriptor_);
    descriptor_ = -1;
  }
  if (descriptor_ < 0) {
    throw InputError(option, "cannot listen on " + where + ": " + std::strerror(error), "choose another port");
  }
  sockaddr_storage bound{};
  socklen_t size = sizeof bound;
  getsockname(descriptor_, reinterpret_cast<sockaddr*>(&bound), &size);
  port_ = ntohs(bound.ss_family == AF_INET6 ? reinterpret_cast<sockaddr_in6&>(bound).sin6_port
                                            : reinterpret_cast<sockaddr_in&>(bound).sin_port);
}

Listener::~Listener() {
  if (descriptor_ >= 0) close(descriptor_);
}

std::optional<Connection> Listener::Accept(double timeout_s) {
  for (int attempt = 0; attempt < 2; ++attempt) {
    const int descriptor = accept(descriptor_, nullptr, nullptr);
    if (descriptor >= 0) return Connection(descriptor);
    if (attempt > 0 || timeout_s <= 0.0 || !WaitFor(descriptor_, POLLIN, timeout_s)) break;
  }
  return std::nullopt;
}

}  // namespace feeler::execution
