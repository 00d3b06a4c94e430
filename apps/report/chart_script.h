// The script that makes charts in pages answer to a pointer (chart.h).
#pragma once

namespace counterpoint::apps {

/// JavaScript, once a page: zoom along x, values under the cursor. Without it charts are pictures.
const char* chart_script();

}  // namespace counterpoint::apps
