// Target for the messages of live pages: their commands, and the options that they set.
#include <cmath>
#include <cstdlib>

#include "apps/live/protocol.h"
#include "counterpoint/model/scene.h"
#include "fuzz/fuzz.h"

namespace counterpoint::fuzz {

void read_live_message(std::string_view input) {
  const live::Command command = live::parse_command(input);
  if (command.index < 0 || !std::isfinite(command.value) || !command.point.allFinite() ||
      !command.target.allFinite())
    std::abort();
  if (command.kind != live::Command::Kind::kSet) return;
  SimulationOptions options;
  set_option(command.key, command.text, options);
  if (!(options.time_step > 0.0) || !(options.contact.compliance > 0.0)) std::abort();
}

}  // namespace counterpoint::fuzz
