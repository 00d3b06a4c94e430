// Closures in reports.
#pragma once

#include "counterpoint/model/parts/closure.h"
#include "report/report.h"

namespace counterpoint::apps {

/// Returns the values of a closure and how far it is open, without the names of its links.
Json closure_json(const Closure& closure, const ClosureGap& gap);

}  // namespace counterpoint::apps
