#include "interrupt.h"

#include <signal.h>
#include <sys/time.h>
#include <unistd.h>

namespace counterpoint::apps {
namespace {

/// Time from the signal until the program is ended by force, unless the computation ends itself
/// [us].
constexpr suseconds_t kPatience = 900'000;

volatile sig_atomic_t noted = 0;

void set_timer(suseconds_t microseconds) {
  const itimerval value{{0, 0}, {0, microseconds}};
  setitimer(ITIMER_REAL, &value, nullptr);
}

void note(int signal) {
  noted = 1;
  ::signal(signal, SIG_DFL);
  set_timer(kPatience);
}

/// Uses only functions that are safe in a signal handler. Tables are on disk up to their last full
/// block.
void end_now(int) {
  const char text[] =
      "\nerror: stopped by Ctrl-C or SIGTERM in the middle of a long computation: tables hold what "
      "was written so far, "
      "there is no report\n";
  [[maybe_unused]] const auto written = ::write(STDERR_FILENO, text, sizeof text - 1);
  ::_exit(1);
}

}  // namespace

Interrupt::Interrupt() {
  noted = 0;
  ::signal(SIGALRM, end_now);
  ::signal(SIGINT, note);
  ::signal(SIGTERM, note);
}

Interrupt::~Interrupt() { end(); }

void Interrupt::end() {
  ::signal(SIGINT, SIG_DFL);
  ::signal(SIGTERM, SIG_DFL);
  set_timer(0);
}

void Interrupt::want() { noted = 1; }

bool Interrupt::wanted() { return noted != 0; }

}  // namespace counterpoint::apps
