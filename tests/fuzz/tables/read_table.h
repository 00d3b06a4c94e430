// Common part of the targets for tables.
#pragma once

#include <cstdlib>
#include <filesystem>

#include "counterpoint/engine/trajectory.h"
#include "fuzz/fuzz.h"
#include "fuzz/small_model.h"

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

/// Reads a file in a format other than CSV as a trajectory of a small model, and every cell.
inline void read_table(const char* name, std::string_view input) {
  const std::filesystem::path file = write(name, input);
  read_as_trajectory(file, small_model());
  const Table table(file);
  for (int row = 0; row < table.num_rows(); ++row) {
    for (int column = 0; column < table.num_columns(); ++column) table.cell(row, column);
  }
}

}  // namespace counterpoint::fuzz
