// A state in a file, from which a run is resumed to the same bits (docs/reference/trajectory-format.md, State files).
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "counterpoint/engine/state.h"
#include "counterpoint/model/scene.h"

namespace counterpoint {

/// Of all in a model that shapes its motion: joints, inertias, shapes, surfaces, what acts in
/// joints, closures, gravity, pairs left out.
std::uint64_t model_hash(const Model& model);
/// Of all in the options that does: time step and its control, integrator,
/// contact, effects.
std::uint64_t options_hash(const SimulationOptions& options);

/// Writes the state with its hash and those of model and options, and the length that the next
/// controlled step will try [s], if any. @throws InputError when the file cannot be created.
void write_state(const std::filesystem::path& file, const Model& model,
                 const SimulationOptions& options, const State& state,
                 std::optional<double> next_step = std::nullopt);

/// May the model and the options be others than those the state was saved from?
enum class SceneCheck { kSame, kAny };

/// Reads a state of this model, bit for bit as written; of a trajectory, its last row. @throws
/// InputError when a coordinate is missing or unknown, when the numbers are not those that were
/// written, and, if the scene is to be the same, when model or options are not.
State read_state(const std::filesystem::path& file, const Model& model,
                 const SimulationOptions& options, SceneCheck check = SceneCheck::kSame);
/// The length that the next controlled step will try [s], where the file says it. @throws
/// InputError where that is not positive.
std::optional<double> read_next_step(const std::filesystem::path& file);

}  // namespace counterpoint
