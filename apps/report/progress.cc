#include "progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

namespace counterpoint::apps {
namespace {

constexpr auto kInterval = std::chrono::milliseconds(100);
constexpr double kLogSeconds = 60.0;  // between two lines of a log
constexpr int kBarWidth = 40;         // characters
constexpr double kLeastShare = 0.01;  // finished before the remaining time is estimated

}  // namespace

Progress::Progress(std::string label, std::int64_t total, double delay, std::string unit)
    : label_(std::move(label)),
      unit_(std::move(unit)),
      total_(std::max<std::int64_t>(total, 1)),
      terminal_(isatty(STDERR_FILENO) == 1),
      start_(Clock::now()),
      next_draw_(start_ + std::chrono::duration_cast<Clock::duration>(
                              std::chrono::duration<double>(terminal_ ? delay : kLogSeconds))) {}

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

std::string Progress::rate_and_rest(double done) const {
  const double share = done / static_cast<double>(total_);
  std::string text;
  if (!unit_.empty()) text += fmt::format(", {:.4g} {} a second", done / elapsed(), unit_);
  if (share > kLeastShare) text += fmt::format(", {:.0f} s left", elapsed() * (1.0 / share - 1.0));
  return text;
}

void Progress::log(double done) {
  const Clock::time_point now = Clock::now();
  if (unit_.empty() || now < next_draw_) return;
  next_draw_ =
      now + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(kLogSeconds));
  fmt::print(stderr, "{}: {:.0f} of {}{}\n", label_, std::floor(done), total_, rate_and_rest(done));
}

void Progress::update(double done) {
  if (!terminal_) return log(done);
  if (!due()) return;
  const double share = std::clamp(done / static_cast<double>(total_), 0.0, 1.0);
  const int filled = static_cast<int>(share * kBarWidth);
  fmt::print(stderr, "\r{} [{:#<{}}{:.<{}}] {:3.0f} %{}\033[K", label_, "", filled, "",
             kBarWidth - filled, 100 * share, rate_and_rest(done));
  std::fflush(stderr);
}

}  // namespace counterpoint::apps
