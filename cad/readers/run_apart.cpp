#include "feeler/cad/readers/run_apart.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <new>

#include "feeler/core/interrupted.h"

namespace feeler::cad {
namespace {

[[noreturn]] void Serve(int pipe, pid_t parent, const std::function<std::string()>& work, unsigned most_cpu_s) {
  // What a library has to say is not for who reads our messages.
  if (const int nowhere = open("/dev/null", O_WRONLY); nowhere >= 0) {
    dup2(nowhere, STDOUT_FILENO);
    dup2(nowhere, STDERR_FILENO);
  }
  // Whoever ends the parent ends this.
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) std::signal(number, SIG_DFL);
  std::signal(SIGXCPU, SIG_DFL);
  const rlimit limit{most_cpu_s, most_cpu_s + 1};  // its own clock begins with it
  setrlimit(RLIMIT_CPU, &limit);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(1);
  std::string bytes;
  try {
    bytes = work();
  } catch (const std::bad_alloc&) {
    _exit(1);
  }
  for (std::size_t sent = 0; sent < bytes.size();) {
    const ssize_t now = write(pipe, bytes.data() + sent, bytes.size() - sent);
    if (now < 0 && errno != EINTR) _exit(1);
    if (now > 0) sent += static_cast<std::size_t>(now);
  }
  _exit(0);  // what the parent made stays
}

int Wait(pid_t child) {
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return status;
}

}  // namespace

std::string RunApart(const std::function<std::string()>& work, unsigned most_cpu_s) {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) throw std::bad_alloc();
  std::fflush(nullptr);
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child == 0) {
    close(ends[0]);
    Serve(ends[1], parent, work, most_cpu_s);
  }
  close(ends[1]);
  if (child < 0) {
    close(ends[0]);
    throw std::bad_alloc();
  }
  std::string bytes;
  std::array<char, 65536> part{};
  ssize_t now = 0;
  while ((now = read(ends[0], part.data(), part.size())) > 0) bytes.append(part.data(), static_cast<std::size_t>(now));
  const bool interrupted = now < 0 && errno == EINTR;
  close(ends[0]);
  if (interrupted) kill(child, SIGKILL);
  const int status = Wait(child);
  if (interrupted) throw Interrupted();
  if (WIFSIGNALED(status)) throw ChildDied{WTERMSIG(status)};
  if (WEXITSTATUS(status) != 0) throw std::bad_alloc();
  return bytes;
}

}  // namespace feeler::cad
