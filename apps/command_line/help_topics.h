#pragma once

#include "command_line.h"

namespace counterpoint::apps {

/// What `counterpoint help TOPIC` shows beside the commands.
void add_topics(CommandLine& line);

}  // namespace counterpoint::apps
