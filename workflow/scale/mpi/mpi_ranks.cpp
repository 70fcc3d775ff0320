#include "feeler/workflow/scale/mpi/mpi_ranks.h"

#define OMPI_SKIP_MPICXX 1
#define MPICH_SKIP_MPICXX 1
#include <fmt/format.h>
#include <mpi.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>
#include <utility>

#include "feeler/core/error.h"
#include "feeler/core/interrupted.h"
#include "feeler/core/json_depth.h"
#include "feeler/workflow/scale/mpi/mpi_post.h"

namespace feeler::workflow {
namespace {

using std::chrono::microseconds;
using std::chrono::steady_clock;

/// Between two looks for a message: short after one has come, then longer.
constexpr auto kShortNap = microseconds(50);
constexpr auto kLongNap = microseconds(1000);
/// After a cancellation, for answers that are nearly there. Signals end a process 1.5 s after they came.
constexpr auto kGrace = std::chrono::milliseconds(1000);

/// For the others to go once rank 0 has said so: they finish what cannot be cancelled, an episode.
constexpr auto kPatience = std::chrono::seconds(20);

double ProcessCpuSeconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

std::string HostName() {
  std::array<char, 256> name{};
  gethostname(name.data(), name.size() - 1);
  return name.data();
}

/// A nap that grows while nothing happens.
class Nap {
 public:
  void Reset() { length_ = kShortNap; }
  microseconds Next() {
    const microseconds now = length_;
    length_ = std::min<microseconds>(kLongNap, length_ * 2);
    return now;
  }

 private:
  microseconds length_ = kShortNap;
};

/// What the greeting of a rank holds.
struct Greeting {
  std::string host;
  std::string identity;
  int threads = 1;
  std::string failure;  ///< its error; empty if it serves
  int exit_code = 0;
};

std::string ToBytes(const Greeting& greeting) {
  return nlohmann::json{{"host", greeting.host},
                        {"identity", greeting.identity},
                        {"threads", greeting.threads},
                        {"failure", greeting.failure},
                        {"exit_code", greeting.exit_code}}
      .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

Greeting GreetingFrom(const std::string& bytes) {
  const auto json = ParseJsonText<nlohmann::json>(bytes);
  return {json.at("host"), json.at("identity"), json.at("threads"), json.at("failure"), json.at("exit_code")};
}

[[noreturn]] void ThrowFailure(int rank, const Greeting& greeting) {
  const std::string where = fmt::format("rank {} on {}", rank, greeting.host);
  if (greeting.exit_code == 2) throw InputError(where, greeting.failure, "all ranks read the same files");
  throw NegativeResult(where, greeting.failure);
}

/// Names the first entry in which two identities differ.
void RequireSame(const std::string& own, const Greeting& other, int rank) {
  if (own == other.identity) return;
  const auto mine = ParseJsonText<nlohmann::json>(own);
  const auto theirs = ParseJsonText<nlohmann::json>(other.identity);
  std::string what = "command";
  for (const auto& [key, value] : mine.items()) {
    if (theirs.is_object() && theirs.contains(key) && theirs[key] == value) continue;
    const std::string there = theirs.is_object() && theirs.contains(key) ? theirs[key].dump() : "none";
    what = fmt::format("{} ({}, not {})", key, there, value.dump());
    break;
  }
  throw InputError(fmt::format("rank {} on {}", rank, other.host), "has another " + what + " than rank 0",
                   "give all hosts the same version of feeler, task files and command");
}

class MpiRanks final : public Ranks {
 public:
  explicit MpiRanks(CancellationToken& cancellation) : cancellation_(cancellation) {
    int provided = 0;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_SERIALIZED, &provided);
    if (provided < MPI_THREAD_SERIALIZED) {
      throw Error("ranks", "this MPI allows one thread alone to call it", "use an MPI with MPI_THREAD_SERIALIZED");
    }
    MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
    MPI_Comm_size(MPI_COMM_WORLD, &size_);
    accounts_.resize(static_cast<std::size_t>(size_));
    greetings_.resize(static_cast<std::size_t>(size_));
    for (int i = 0; i < size_; ++i) accounts_[static_cast<std::size_t>(i)].rank = i;
    accounts_.front().host = HostName();
  }

  ~MpiRanks() override {
    if (rank_ == 0) Dismiss();
    MPI_Finalize();
  }

  int rank() const override { return rank_; }
  int size() const override { return size_; }

  void Assemble(const std::string& identity) override {
    Nap nap;
    for (int missing = size_ - 1; missing > 0;) {
      Message message;
      if (!post_.Receive(message)) {
        if (cancellation_.cancelled()) throw Interrupted();
        std::this_thread::sleep_for(nap.Next());
        continue;
      }
      nap.Reset();
      if (message.kind != MessageKind::kGreeting) continue;
      Greeting greeting = GreetingFrom(message.bytes);
      --missing;
      if (!greeting.failure.empty()) ThrowFailure(message.rank, greeting);
      RequireSame(identity, greeting, message.rank);
      accounts_[static_cast<std::size_t>(message.rank)].host = greeting.host;
      greetings_[static_cast<std::size_t>(message.rank)] = std::move(greeting);
    }
    // Lanes go round the ranks, so that the first pieces of work fall to different ones.
    int most = 0;
    for (int i = 1; i < size_; ++i) most = std::max(most, greetings_[static_cast<std::size_t>(i)].threads);
    for (int thread = 0; thread < most; ++thread) {
      for (int i = 1; i < size_; ++i) {
        if (thread < greetings_[static_cast<std::size_t>(i)].threads) workers_.push_back(i);
      }
    }
    calls_.resize(2 * workers_.size());
    pump_ = std::jthread([this](const std::stop_token& stop) { Pump(stop); });
  }

  int LanesFor(std::size_t pieces) const override {
    constexpr std::size_t kPiecesForQueues = 16;
    const std::size_t workers = workers_.size();
    return static_cast<int>(pieces >= kPiecesForQueues * (workers + 1) ? 2 * workers : std::min(pieces, workers));
  }

  std::string Call(int lane, const std::string& request) override {
    const auto index = static_cast<std::size_t>(lane);
    const int rank = workers_[index % workers_.size()];
    std::unique_lock lock(mutex_);
    calls_[index].reset();
    outbox_.push_back({MessageKind::kRequest, rank, fmt::format("{:08x}", lane) + request});
    wake_.notify_one();
    std::optional<steady_clock::time_point> give_up;
    while (!calls_[index] && !failure_) {
      answered_.wait_for(lock, std::chrono::milliseconds(100));
      if (!cancellation_.cancelled()) continue;
      if (!give_up) give_up = steady_clock::now() + kGrace;
      if (steady_clock::now() > *give_up) throw Interrupted();
    }
    if (failure_) std::rethrow_exception(failure_);
    return std::move(*calls_[index]);
  }

  std::vector<RankAccount> Accounts() const override {
    const std::lock_guard lock(mutex_);
    std::vector<RankAccount> accounts = accounts_;
    accounts.front().cpu_s = ProcessCpuSeconds();
    return accounts;
  }

  void Serve(const std::string& identity, int threads, const std::function<Handler()>& make_handler) override {
    post_.Send({MessageKind::kGreeting, 0, ToBytes({HostName(), identity, threads, "", 0})});
    std::vector<std::jthread> workers;
    for (int i = 0; i < threads; ++i) workers.emplace_back([&] { Handle(make_handler); });
    Nap nap;
    bool ended = false;
    while (!ended) {
      Message message;
      bool busy = post_.Receive(message);
      if (busy) ended = Take(std::move(message));
      busy = SendAll() || busy;
      post_.Settle();
      if (busy) {
        nap.Reset();
        continue;
      }
      std::unique_lock lock(mutex_);
      wake_.wait_for(lock, nap.Next(), [&] { return !outbox_.empty(); });
    }
    {
      const std::lock_guard lock(mutex_);
      ended_ = true;
      cancellation_.Cancel();
      work_.notify_all();
    }
    workers.clear();
    SayGoodbye();
  }

  void Fail(const std::string& message, int exit_code) override {
    post_.Send({MessageKind::kGreeting, 0, ToBytes({HostName(), "{}", 1, message, exit_code})});
    Nap nap;
    while (true) {  // until rank 0 has had a chance to tell
      Message end;
      if (post_.Receive(end) && end.kind == MessageKind::kEnd) return SayGoodbye();
      post_.Settle();
      std::this_thread::sleep_for(nap.Next());
    }
  }

 private:
  bool SendAll() {
    std::deque<Message> out;
    {
      const std::lock_guard lock(mutex_);
      out.swap(outbox_);
    }
    for (Message& message : out) post_.Send(std::move(message));
    return !out.empty();
  }

  /// Rank 0: what has come from another.
  void Sort(Message message) {
    const std::lock_guard lock(mutex_);
    if (message.kind == MessageKind::kAnswer) {
      RankAccount& account = accounts_[static_cast<std::size_t>(message.rank)];
      ++account.done;
      account.cpu_s = std::stod(message.bytes.substr(8, 16));
      calls_[std::stoul(message.bytes.substr(0, 8), nullptr, 16)] = message.bytes.substr(24);
    } else if (message.kind == MessageKind::kFailure && !failure_) {
      try {
        ThrowFailure(message.rank, GreetingFrom(message.bytes));
      } catch (...) {
        failure_ = std::current_exception();
      }
    }
    answered_.notify_all();
  }

  void Pump(const std::stop_token& stop) {
    Nap nap;
    bool told = false;
    while (!stop.stop_requested()) {
      Message message;
      bool busy = post_.Receive(message);
      if (busy) Sort(std::move(message));
      busy = SendAll() || busy;
      post_.Settle();
      if (!told && cancellation_.cancelled()) {
        told = true;
        for (int i = 1; i < size_; ++i) post_.Send({MessageKind::kCancel, i, ""});
      }
      if (busy) {
        nap.Reset();
        continue;
      }
      std::unique_lock lock(mutex_);
      wake_.wait_for(lock, nap.Next(), [&] { return !outbox_.empty(); });
    }
  }

  /// Rank 0 has done: the others go.
  void Dismiss() {
    if (pump_.joinable()) {
      pump_.request_stop();
      pump_.join();
    }
    for (int i = 1; i < size_; ++i) post_.Send({MessageKind::kEnd, i, ""});
    Nap nap;
    const auto give_up = steady_clock::now() + kPatience;
    for (int present = size_ - 1; (present > 0 || !post_.Settle()) && steady_clock::now() < give_up;) {
      Message message;
      if (!post_.Receive(message)) {
        std::this_thread::sleep_for(nap.Next());
      } else if (message.kind == MessageKind::kGoodbye) {
        --present;
      }
    }
  }

  /// Another rank: nothing follows.
  void SayGoodbye() {
    SendAll();
    post_.Send({MessageKind::kGoodbye, 0, ""});
    Nap nap;
    const auto give_up = steady_clock::now() + kPatience;
    while (!post_.Settle() && steady_clock::now() < give_up) std::this_thread::sleep_for(nap.Next());
  }

  /// Another rank: what has come from rank 0. True if that was the last.
  bool Take(Message message) {
    if (message.kind == MessageKind::kEnd) return true;
    if (message.kind == MessageKind::kCancel) cancellation_.Cancel();
    if (message.kind != MessageKind::kRequest) return false;
    const std::lock_guard lock(mutex_);
    inbox_.push_back(std::move(message.bytes));
    work_.notify_one();
    return false;
  }

  /// A thread of another rank.
  void Handle(const std::function<Handler()>& make_handler) {
    try {
      const Handler handler = make_handler();
      while (true) {
        std::unique_lock lock(mutex_);
        work_.wait(lock, [&] { return ended_ || !inbox_.empty(); });
        if (ended_) return;
        const std::string request = std::move(inbox_.front());
        inbox_.pop_front();
        lock.unlock();
        const std::string answer = handler(request.substr(8));
        lock.lock();
        outbox_.push_back(
            {MessageKind::kAnswer, 0, request.substr(0, 8) + fmt::format("{:16.6f}", ProcessCpuSeconds()) + answer});
        wake_.notify_one();
      }
    } catch (const std::exception& e) {
      const bool input = dynamic_cast<const InputError*>(&e) != nullptr;
      const std::lock_guard lock(mutex_);
      outbox_.push_back({MessageKind::kFailure, 0, ToBytes({HostName(), "{}", 1, e.what(), input ? 2 : 1})});
      wake_.notify_one();
    }
  }

  CancellationToken& cancellation_;
  int rank_ = 0;
  int size_ = 1;
  MpiPost post_;  // the main thread's, and while it runs the pump's
  std::vector<Greeting> greetings_;
  std::vector<int> workers_;  ///< lane modulo their number -> rank

  mutable std::mutex mutex_;  // guards all below
  std::condition_variable wake_, answered_, work_;
  std::deque<Message> outbox_;
  std::deque<std::string> inbox_;
  std::vector<std::optional<std::string>> calls_;  ///< by lane: the answer
  std::vector<RankAccount> accounts_;
  std::exception_ptr failure_;
  bool ended_ = false;
  std::jthread pump_;
};

}  // namespace

std::unique_ptr<Ranks> ConnectMpiRanks(CancellationToken& cancellation) {
  return std::make_unique<MpiRanks>(cancellation);
}

}  // namespace feeler::workflow
