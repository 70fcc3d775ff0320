#include "feeler/cli/common/progress_bar.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <utility>

#include "feeler/cli/common/console.h"

namespace feeler::cli {
namespace {
constexpr int kWidth = 30;
constexpr auto kRedrawInterval = std::chrono::milliseconds(100);

}  // namespace

ProgressBar::ProgressBar(std::string label)
    : label_(std::move(label)), terminal_(isatty(STDERR_FILENO) != 0), start_(std::chrono::steady_clock::now()) {}

ProgressBar::~ProgressBar() { Finish(); }

void ProgressBar::Update(std::int64_t done, std::int64_t total) {
  if (total <= 0) return;
  const auto now = std::chrono::steady_clock::now();
  const double elapsed_s = std::chrono::duration<double>(now - start_).count();
  const double fraction = std::clamp(static_cast<double>(done) / static_cast<double>(total), 0.0, 1.0);
  const double left_s = fraction > 0 ? elapsed_s / fraction - elapsed_s : 0.0;
  if (terminal_) {
    if (drawn_ && done < total && now - last_draw_ < kRedrawInterval) return;
    const int filled = static_cast<int>(fraction * kWidth);
    Tell(fmt::format("\r{} [{}{}] {}/{}  {:.0f} s, {:.0f} s left \033[K", label_, std::string(filled, '#'),
                     std::string(kWidth - filled, '.'), done, total, elapsed_s, left_s));
  } else {
    const std::int64_t tenth = static_cast<std::int64_t>(fraction * 10);
    if (tenth == last_tenth_) return;
    last_tenth_ = tenth;
    Tell(fmt::format("{}: {}/{}  {:.0f} s\n", label_, done, total, elapsed_s));
  }
  drawn_ = true;
  last_draw_ = now;
}

void ProgressBar::Finish() {
  if (drawn_ && terminal_) Tell("\n");
  drawn_ = false;
}

}  // namespace feeler::cli
