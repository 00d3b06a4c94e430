// Makes the names of the estimation library available in counterpoint::apps.
#pragma once

#include "counterpoint/engine/estimate/estimate.h"
#include "counterpoint/engine/estimate/identifiability.h"
#include "counterpoint/engine/estimate/motion_estimate.h"
#include "counterpoint/engine/estimate/parameter_estimate.h"
#include "counterpoint/engine/estimate/recording.h"

namespace counterpoint::apps {

using namespace estimation;

}  // namespace counterpoint::apps
