// The script that makes the charts of a page interactive (chart.h).
#pragma once

namespace counterpoint::apps {

/// JavaScript, to include once per page: zoom along x, values under the cursor. Charts are static
/// pictures without it.
const char* chart_script();

}  // namespace counterpoint::apps
