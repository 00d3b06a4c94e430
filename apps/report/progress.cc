#include "progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <utility>

namespace counterpoint::apps {
namespace {

constexpr auto kInterval = std::chrono::milliseconds(100);
constexpr int kBarWidth = 40;            // characters
constexpr double kLeastShare = 0.01;  // done, before what is left is estimated

}  // namespace

Progress::Progress(std::string label, int total, double delay)
    : label_(std::move(label)),
      total_(std::max(total, 1)),
      terminal_(isatty(STDERR_FILENO) == 1),
      start_(Clock::now()),
      next_draw_(start_ + std::chrono::duration_cast<Clock::duration>(
                              std::chrono::duration<double>(delay))) {}

Progress::~Progress() { wipe(); }

void Progress::wipe() {
  if (!drawn_) return;
  fmt::print(stderr, "\r\033[K");
  std::fflush(stderr);
  drawn_ = false;
}

bool Progress::due() {
  if (!terminal_) return false;
  const Clock::time_point now = Clock::now();
  if (now < next_draw_) return false;
  next_draw_ = now + kInterval;
  return drawn_ = true;
}

double Progress::elapsed() const {
  return std::chrono::duration<double>(Clock::now() - start_).count();
}

void Progress::show_time() {
  if (!due()) return;
  fmt::print(stderr, "\r{}: {:.0f} s", label_, elapsed());
  std::fflush(stderr);
}

void Progress::update(int done) {
  if (!due()) return;
  const double share = std::clamp(static_cast<double>(done) / total_, 0.0, 1.0);
  const int filled = static_cast<int>(share * kBarWidth);
  const std::string left =
      share > kLeastShare ? fmt::format(", {:.0f} s left", elapsed() * (1.0 / share - 1.0)) : "";
  fmt::print(stderr, "\r{} [{:#<{}}{:.<{}}] {:3.0f} %{}\033[K", label_, "", filled, "",
             kBarWidth - filled, 100 * share, left);
  std::fflush(stderr);
}

}  // namespace counterpoint::apps
