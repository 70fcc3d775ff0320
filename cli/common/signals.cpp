#include "feeler/cli/common/signals.h"

#include <unistd.h>

#include <atomic>
#include <csignal>
#include <ctime>
#include <string_view>

#include "feeler/core/file_output.h"

namespace feeler::cli {
namespace {

constexpr long kGraceNanoseconds = 1'500'000'000;

// Reached from signal handlers.
std::atomic<CancellationToken*> token{nullptr};
std::atomic<int> signals_seen{0};
std::atomic<bool> silent{false};
std::atomic<bool> keeps{false};
timer_t grace_timer;
bool has_timer = false;

/// What a handler may do: no locks, no memory.
[[noreturn]] void EndNow() {
  SettleOutputsInSignalHandler();
  if (silent.load()) _exit(1);
  const std::string_view message = InterruptedMessage();
  [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, message.data(), message.size());
  _exit(1);
}

extern "C" void OnGraceOver(int /*number*/) { EndNow(); }

extern "C" void OnSignal(int number) {
  if (signals_seen.fetch_add(1) > 0) {
    SettleOutputsInSignalHandler();
    signal(number, SIG_DFL);
    raise(number);
    sigset_t only;
    sigemptyset(&only);
    sigaddset(&only, number);
    pthread_sigmask(SIG_UNBLOCK, &only, nullptr);
    _exit(128 + number);
  }
  if (CancellationToken* cancellation = token.load()) cancellation->Cancel();
  if (!has_timer) return;
  itimerspec after{};
  after.it_value.tv_sec = kGraceNanoseconds / 1'000'000'000;
  after.it_value.tv_nsec = kGraceNanoseconds % 1'000'000'000;
  timer_settime(grace_timer, 0, &after, nullptr);
}

void Handle(int number, void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;  // without SA_RESTART: opening and reading a FIFO ends too
  sigemptyset(&action.sa_mask);
  sigaction(number, &action, nullptr);
}

}  // namespace

void EndSilently() { silent = true; }

void KeepsWhatIsDone() { keeps = true; }

std::string_view InterruptedMessage() {
  return keeps.load() ? "feeler: interrupted: what was done is kept\n"
                      : "feeler: interrupted: nothing was begun that could be kept\n";
}

void CancelOnSignals(CancellationToken& cancellation) {
  token = &cancellation;
  signal(SIGPIPE, SIG_IGN);
  sigevent event{};
  event.sigev_notify = SIGEV_SIGNAL;
  event.sigev_signo = SIGALRM;
  Handle(SIGALRM, OnGraceOver);
  has_timer = timer_create(CLOCK_MONOTONIC, &event, &grace_timer) == 0;
  sigset_t ours;
  sigemptyset(&ours);
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGALRM}) sigaddset(&ours, number);
  pthread_sigmask(SIG_UNBLOCK, &ours, nullptr);  // a parent may have blocked them
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction before {};
    sigaction(number, nullptr, &before);
    if (number == SIGHUP && before.sa_handler == SIG_IGN) continue;  // nohup
    Handle(number, OnSignal);
  }
}

}  // namespace feeler::cli
