// The median of a few numbers, the library's.
#pragma once

#include "counterpoint/engine/estimate/recording.h"

namespace counterpoint::apps {

using estimation::median;

}  // namespace counterpoint::apps
