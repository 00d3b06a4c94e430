// Column maps of recordings that tests make themselves.
#pragma once

#include "counterpoint/engine/estimate/recording.h"

namespace counterpoint::test {

/// All positions of a scene, with no deviation given.
inline estimation::ColumnMap all_positions(const Model& model) {
  using Entry = estimation::ColumnMap::Entry;
  estimation::ColumnMap map;
  for (int i = 0; i < model.nq(); ++i)
    map.entries.push_back({Entry::Kind::kPosition, i, "q", {"q", 1.0, 0.0}});
  return map;
}

}  // namespace counterpoint::test
