#pragma once

#include "command_line.h"

namespace counterpoint::apps {

/// Adds the topics of `counterpoint help TOPIC`.
void add_topics(CommandLine& line);

}  // namespace counterpoint::apps
