// Progress bars are drawn on terminals only, and only for long work.
#include "report/progress.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

namespace counterpoint::apps::progress_test {
namespace {

constexpr double kNever = 3600.0;  // [s] longer than any test
constexpr int kPatience = 200;     // [ms] wait for more output of the terminal

/// Text that two updates of a bar write to standard error, redirected to `descriptor` and read from
/// `reader`.
std::string written(int descriptor, int reader, double delay) {
  const int saved = dup(STDERR_FILENO);
  dup2(descriptor, STDERR_FILENO);
  {
    Progress bar("working", 4, delay);
    bar.update(2);
    bar.update(3);
  }
  dup2(saved, STDERR_FILENO);
  close(saved);
  // A terminal delivers its text in parts, some with a delay.
  std::string out;
  pollfd waiting{reader, POLLIN, 0};
  while (poll(&waiting, 1, kPatience) > 0 && (waiting.revents & POLLIN) != 0) {
    char part[4096];
    const ssize_t size = read(reader, part, sizeof part);
    if (size <= 0) break;
    out.append(part, static_cast<size_t>(size));
  }
  return out;
}

std::string on_terminal(double delay) {
  const int terminal = posix_openpt(O_RDWR | O_NOCTTY);
  if (terminal < 0 || grantpt(terminal) != 0 || unlockpt(terminal) != 0) return "no terminal";
  const int end = open(ptsname(terminal), O_RDWR | O_NOCTTY);
  const std::string out = written(end, terminal, delay);
  close(end);
  close(terminal);
  return out;
}

TEST(Progress, IsDrawnOnATerminalAndWiped) {
  const std::string out = on_terminal(0.0);
  if (out == "no terminal") GTEST_SKIP() << "pseudo terminals cannot be opened here";
  EXPECT_NE(out.find("working [####################....................]  50 %"), std::string::npos)
      << out;
  EXPECT_EQ(out.substr(out.size() - 4), "\r\033[K") << out;
}

TEST(Progress, OfShortWorkIsNotDrawn) {
  const std::string out = on_terminal(kNever);
  if (out == "no terminal") GTEST_SKIP() << "pseudo terminals cannot be opened here";
  EXPECT_EQ(out, "");
}

TEST(Progress, IsNotWrittenToFiles) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  EXPECT_EQ(written(ends[1], ends[0], 0.0), "");
  close(ends[0]);
  close(ends[1]);
}

}  // namespace
}  // namespace counterpoint::apps::progress_test
