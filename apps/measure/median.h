// Median of a few numbers; the function of the estimation library.
#pragma once

#include "counterpoint/engine/estimate/recording.h"

namespace counterpoint::apps {

using estimation::median;

}  // namespace counterpoint::apps
