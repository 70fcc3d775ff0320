#include "feeler/execution/remote/link.h"

#include <algorithm>
#include <ctime>
#include <limits>
#include <utility>

namespace feeler::execution {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

void SleepSeconds(double seconds) {
  if (!(seconds > 0.0)) return;
  timespec wait{static_cast<time_t>(seconds), 0};
  wait.tv_nsec = static_cast<long>((seconds - static_cast<double>(wait.tv_sec)) * 1e9);
  nanosleep(&wait, nullptr);
}

}  // namespace

Link::Link(Connection connection, double latency_s, double jitter_s, RandomStream random)
    : connection_(std::move(connection)), latency_s_(latency_s), jitter_s_(jitter_s), random_(random) {}

double Link::Delay(double last_s) {
  const std::lock_guard lock(sending_);
  const double at_s = MonotonicSeconds() + latency_s_ + (jitter_s_ > 0.0 ? random_.Uniform(0.0, jitter_s_) : 0.0);
  return std::max(at_s, last_s);
}

void Link::Flush() {
  const std::lock_guard lock(sending_);
  while (!outbox_.empty() && outbox_.front().at_s <= MonotonicSeconds()) {
    writable_ = writable_ && connection_.Write(outbox_.front().line);
    outbox_.pop_front();
  }
}

double Link::NextRelease() {
  const std::lock_guard lock(sending_);
  const double in_s = inbox_.empty() ? kNever : inbox_.front().at_s;
  return std::min(in_s, outbox_.empty() ? kNever : outbox_.front().at_s);
}

LineStatus Link::Receive(std::string& line, double timeout_s, std::size_t most_bytes) {
  const bool delays = latency_s_ > 0.0 || jitter_s_ > 0.0;
  if (!delays) return connection_.ReadLine(line, timeout_s, most_bytes);
  const double end_s = MonotonicSeconds() + timeout_s;
  for (;;) {
    Flush();
    while (!closed_ && !too_long_) {
      std::string got;
      const LineStatus status = connection_.ReadLine(got, 0.0, most_bytes);
      if (status == LineStatus::kTimeout) break;
      closed_ = status == LineStatus::kClosed;
      too_long_ = status == LineStatus::kTooLong;
      if (status == LineStatus::kLine) {
        inbox_.push_back({Delay(inbox_.empty() ? 0.0 : inbox_.back().at_s), std::move(got)});
      }
    }
    const double now_s = MonotonicSeconds();
    if (!inbox_.empty() && inbox_.front().at_s <= now_s) {
      line = std::move(inbox_.front().line);
      inbox_.pop_front();
      return LineStatus::kLine;
    }
    if (inbox_.empty() && too_long_) return LineStatus::kTooLong;
    if (inbox_.empty() && closed_) return LineStatus::kClosed;
    if (now_s >= end_s) return LineStatus::kTimeout;
    const double wait_s = std::min(end_s, NextRelease()) - now_s;
    std::string got;
    if (closed_ || too_long_) {
      SleepSeconds(wait_s);
    } else if (connection_.ReadLine(got, std::max(wait_s, 1e-5), most_bytes) == LineStatus::kLine) {
      inbox_.push_back({Delay(inbox_.empty() ? 0.0 : inbox_.back().at_s), std::move(got)});
    }
  }
}

bool Link::Send(const std::string& line) {
  const std::lock_guard lock(sending_);
  if (latency_s_ > 0.0 || jitter_s_ > 0.0) {
    outbox_.push_back({Delay(outbox_.empty() ? 0.0 : outbox_.back().at_s), line + "\n"});
    Flush();
  } else {
    writable_ = writable_ && connection_.Write(line + "\n");
  }
  return writable_;
}

void Link::SendRaw(const std::string& bytes) {
  const std::lock_guard lock(sending_);
  connection_.Write(bytes);
}

void Link::Close() {
  const std::lock_guard lock(sending_);
  while (!outbox_.empty() && connection_.open()) {
    SleepSeconds(outbox_.front().at_s - MonotonicSeconds());
    Flush();
  }
  if (writable_) connection_.Finish();
  Cut();
}

void Link::Cut() {
  const std::lock_guard lock(sending_);
  connection_.Shutdown();  // closed where the link ends: another thread may be reading
  writable_ = false;
}

}  // namespace feeler::execution
