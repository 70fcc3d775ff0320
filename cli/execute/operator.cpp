#include "feeler/cli/execute/operator.h"

#include <poll.h>
#include <unistd.h>

#include "feeler/cli/common/console.h"

namespace feeler::cli {

bool Operator::Agrees(const std::string& question) {
  Tell(question);
  std::string answer;
  for (;;) {
    if (cancellation_ != nullptr && cancellation_->cancelled()) return false;
    constexpr int kLook_ms = 100;
    pollfd entry{STDIN_FILENO, POLLIN, 0};
    if (poll(&entry, 1, kLook_ms) <= 0) continue;
    char c = 0;
    if (read(STDIN_FILENO, &c, 1) != 1) return false;
    if (c == '\n') break;
    if (answer.size() < 100) answer += c;
  }
  return answer.empty() || answer == "y" || answer == "yes" || answer == "go" || answer == "start";
}

}  // namespace feeler::cli
