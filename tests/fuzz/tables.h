// What the targets of tables share.
#pragma once

#include <cstdlib>
#include <filesystem>

#include "counterpoint/engine/io/table.h"
#include "counterpoint/engine/io/trajectory.h"

namespace counterpoint::fuzz {

template <typename Read>
void try_read(const Read& read) {
  try {
    read();
  } catch (const InputError&) {
  }
}

inline void read_as_trajectory(const std::filesystem::path& file, const Model& model) {
  try_read([&] {
    const Trajectory trajectory = read_trajectory(file, model);
    if (!trajectory.q.allFinite() || !trajectory.v.allFinite()) std::abort();
    step_lengths(trajectory, std::nullopt, 0.1);
  });
}

}  // namespace counterpoint::fuzz
