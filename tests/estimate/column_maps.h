// Column maps for recordings that tests simulate.
#pragma once

#include "counterpoint/engine/estimate/recording.h"

namespace counterpoint::test {

/// Maps all positions of a scene, without standard deviations.
inline estimation::ColumnMap all_positions(const Model& model) {
  using Entry = estimation::ColumnMap::Entry;
  estimation::ColumnMap map;
  for (int i = 0; i < model.nq(); ++i)
    map.entries.push_back({Entry::Kind::kPosition, i, "q", {"q", 1.0, 0.0}});
  return map;
}

}  // namespace counterpoint::test
