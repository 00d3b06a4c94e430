// Targets for tables: as trajectories, inputs and recordings of a small robot, and as contact
// problems.
#include <cstdlib>

#include "apps/input/inputs.h"
#include "apps/input/problem_file.h"
#include "counterpoint/engine/estimate/recording.h"
#include "counterpoint/engine/trajectory.h"
#include "counterpoint/model/scene.h"
#include "fuzz/fuzz.h"

namespace counterpoint::fuzz {
namespace {

/// The small robot on a floating base, with a servo.
const Model& small_model() {
  static const Model model = [] {
    write("small.urdf", kSmallRobot);
    const char* scene =
        "models: [{urdf: small.urdf, base: floating, dynamics: {j: {servo: {stiffness: 1}}}}]\n";
    return load_scene(write("small.yaml", scene)).model;
  }();
  return model;
}

template <typename Read>
void try_read(const Read& read) {
  try {
    read();
  } catch (const InputError&) {
  }
}

void read_as_trajectory(const std::filesystem::path& file, const Model& model) {
  try_read([&] {
    const Trajectory trajectory = read_trajectory(file, model);
    if (!trajectory.q.allFinite() || !trajectory.v.allFinite()) std::abort();
    step_lengths(trajectory, std::nullopt, 0.1);
  });
}

void read_cells(const std::filesystem::path& file, const TableOptions& options = {}) {
  const Table table(file, {}, options);
  for (int row = 0; row < table.num_rows(); ++row)
    for (int column = 0; column < table.num_columns(); ++column) table.cell(row, column);
}

/// Reads a file in a format other than CSV as a trajectory, and every cell.
void read_table(const char* name, std::string_view input) {
  const std::filesystem::path file = write(name, input);
  read_as_trajectory(file, small_model());
  read_cells(file);
}

}  // namespace

/// BVH files: all joints of all frames.
void read_bvh(std::string_view input) {
  TableOptions options;
  options.any_unit = true;
  read_cells(write("table.bvh", input), options);
}

void read_c3d(std::string_view input) { read_table("table.c3d", input); }
void read_hdf5(std::string_view input) { read_table("table.h5", input); }
void read_mcap(std::string_view input) { read_table("table.mcap", input); }
void read_npz(std::string_view input) { read_table("table.npz", input); }
void read_trc(std::string_view input) { read_table("table.trc", input); }

/// CSV files as plain tables, as trajectories of a small model, and as its inputs.
void read_csv(std::string_view input) {
  const std::filesystem::path file = write("table.csv", input);
  const Model& model = small_model();
  read_as_trajectory(file, model);
  try_read([&] {
    apps::InputSchedule schedule(file, model);
    Input applied;
    for (const double time : {-1.0, 0.0, 0.5, 1e300}) {
      applied.applied_force.setZero(model.nv());
      schedule.apply(model, time, 0.0, applied);
      if (!applied.applied_force.allFinite()) std::abort();
    }
  });
  read_cells(file);
}

/// Column maps of `compare`, and a recording read through each.
void read_column_map(std::string_view input) {
  const Model& model = small_model();
  static const std::filesystem::path table =
      write("recording.csv", "t,a,b,c,d,e,f,g\n0,1,2,3,1,0,0,0\n0.1,1,2,3,1,0,0,0\n");
  const estimation::ColumnMap map = estimation::load_column_map(write("map.yaml", input), model);
  for (const estimation::Recording& recording :
       estimation::read_recordings(table, map, model, model.default_q(), VectorX::Zero(model.nv())))
    if (!recording.q.allFinite() || !recording.v.allFinite()) std::abort();
}

/// Contact problems: q_mu.csv and W.csv, separated by a line "===".
void read_contact_problem(std::string_view input) {
  constexpr std::string_view kCut = "===\n";
  const size_t cut = input.find(kCut);
  const size_t after = cut == std::string_view::npos ? input.size() : cut + kCut.size();
  write("q_mu.csv", input.substr(0, cut));
  write("W.csv", input.substr(after));
  const contact::ContactSpaceProblem problem = apps::read_contact_problem(folder());
  if (!problem.A.allFinite() || !problem.c.allFinite()) std::abort();
  if (problem.c.size() != 3 * problem.num_contacts()) std::abort();
}

}  // namespace counterpoint::fuzz
