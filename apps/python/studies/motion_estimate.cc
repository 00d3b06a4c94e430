// counterpoint.recordings.estimate_motion: estimates the motion behind a noisy recording, and its
// forces.
#include <pybind11/stl.h>

#include "counterpoint/engine/estimate/motion_follower.h"
#include "objects/arrays.h"
#include "objects/handles.h"
#include "objects/typed.h"
#include "recordings/estimation.h"

namespace counterpoint::python {
namespace {

using apps::ColumnMap;
using apps::MotionEstimate;
using apps::MotionEstimateOptions;
using apps::Recording;
using apps::RecordingErrors;
using Explained = Typed<py::dict, "_MotionEstimate">;

std::optional<RecordingErrors> errors_of(const std::optional<std::string>& errors) {
  if (!errors) return std::nullopt;
  if (*errors == "white") return RecordingErrors::kWhite;
  if (*errors == "slow") return RecordingErrors::kSlow;
  throw py::value_error("errors: expected 'white', 'slow' or None, not '" + *errors + "'");
}

template <class Options>
void set_sums(const ColumnMap& map, Options& options) {
  for (const ColumnMap::ContactForce& force : map.contact_forces)
    options.sums.push_back({force.name, force.bodies});
}

/// Contact forces on links, by the name of their sum.
py::dict contact_forces_of(const MotionEstimate& estimate) {
  py::dict out;
  for (std::size_t s = 0; s < estimate.sums.size(); ++s) {
    const auto at = 3 * static_cast<Eigen::Index>(s);
    py::dict one;
    one["force"] = copy_matrix(estimate.sum_force.middleRows(at, 3), true);
    one["deviation"] = copy_matrix(estimate.sum_deviation.middleRows(at, 3), true);
    one["centre"] = copy_matrix(estimate.sum_centre.middleRows(at, 3), true);
    const py::str name(estimate.sums[s].name);
    if (!out.contains(name)) out[name] = one;
  }
  return out;
}

Explained dict_of(const MotionEstimate& found) {
  Explained out;
  out["file"] = found.file;
  out["time"] = py::array_t<double>(static_cast<py::ssize_t>(found.time.size()), found.time.data());
  out["q"] = copy_matrix(found.q, true);
  out["v"] = copy_matrix(found.v, true);
  out["force"] = copy_matrix(found.force, true);
  out["force_deviation"] = copy_matrix(found.force_deviation, true);
  out["contact_forces"] = contact_forces_of(found);
  out["errors"] = apps::recording_errors_name(found.errors);
  out["cost_ratio"] = found.mean_cost_ratio;
  out["unexplained_mean"] = found.unexplained_mean;
  out["unexplained_max"] = found.unexplained_max;
  py::dict parameters;
  for (const apps::EstimatedParameter& one : found.parameters)
    parameters[py::str(one.name)] = py::make_tuple(one.value, one.deviation);
  out["parameters"] = parameters;
  py::dict sensors;
  for (const apps::SensorMetrics& one : found.sensors)
    sensors[py::str("{} ({})").format(one.name, apps::sensor_kind_name(one.kind))] =
        py::make_tuple(one.rms, one.deviation);
  out["sensors"] = sensors;
  return out;
}

Explained estimate(const SceneHandle& handle, const ColumnMap& map, const Recording& recording,
                   const std::optional<std::string>& errors, int threads) {
  MotionEstimateOptions options;
  options.threads = threads;
  options.errors = errors_of(errors);
  set_sums(map, options);
  const Scene scene = handle.scene();
  MotionEstimate found;
  {
    const py::gil_scoped_release release;
    found = apps::estimate_motion(scene, map, recording, options);
  }
  return dict_of(found);
}

constexpr const char* kEstimateDoc = R"(
The motion behind a noisy recording, and its forces with standard deviations, as
`counterpoint explain` finds them (docs/explanation/explaining.md).

Parameters
----------
scene : Scene
columns : ColumnMap
recording : Recording
errors : {'white', 'slow'}, optional
    Errors of recorded positions; default: found from the recording.
threads : int
    0: one a core; the result does not depend on it.

Returns
-------
dict
    'file'; 'time' (rows,) [s]; 'q' (rows, nq); 'v' (rows, nv); 'force' and 'force_deviation'
    (rows, nv) [N, N m]: forces of joints, and unexplained ones of free links, NaN in the first and
    the last row; 'contact_forces': by the names of the map's `contact_forces` and of links that
    touch something, dicts of 'force', 'deviation' [N] and 'centre' (of pressure) [m], (rows, 3) in
    world axes; 'errors': 'none', 'white' or 'slow'; 'cost_ratio' [-]; 'unexplained_mean',
    'unexplained_max' [weights]; 'parameters': difference from the scene's and standard deviation
    by name; 'sensors': root mean square of the residuals and standard deviation, of a component
    in a row, by the name, a space and the kind in brackets.

Raises
------
InputError
    Where the recording has too few rows, or no position.
)";

}  // namespace

constexpr const char* kFollowerDoc = R"(
Explains rows as they come (docs/explanation/explaining.md, Row by row): a row is told once `lag` rows
have followed it, the first 50 late.

Parameters
----------
scene : Scene
columns : ColumnMap
window, lag : int
    Rows explained together, and rows that follow before one is told.
errors : {'white', 'slow'}, optional
    Default: found from the first rows.
threads : int
    0: one a core; the result does not depend on it.
)";

void bind_motion_estimate(py::module_& r) {
  using apps::MotionFollower;
  py::class_<MotionFollower>(r, "MotionFollower", kFollowerDoc)
      .def(py::init([](const SceneHandle& handle, const ColumnMap& map, int window, int lag,
                       const std::optional<std::string>& errors, int threads) {
             apps::FollowOptions options;
             options.window = window;
             options.lag = lag;
             options.threads = threads;
             options.errors = errors_of(errors);
             set_sums(map, options);
             return std::make_unique<MotionFollower>(handle.scene(), map, options);
           }),
           py::arg("scene"), py::arg("columns"), py::kw_only(), py::arg("window") = 30,
           py::arg("lag") = 10, py::arg("errors") = py::none(), py::arg("threads") = 1)
      .def(
          "push",
          [](MotionFollower& follower, double time, const std::vector<double>& q) {
            const auto size = static_cast<Eigen::Index>(q.size());
            return dict_of(follower.push(time, Eigen::Map<const VectorX>(q.data(), size)));
          },
          py::arg("time"), py::arg("q"),
          "A row: time [s] and q (nq,), NaN where nothing was measured. Returns the rows known "
          "now, "
          "as `estimate_motion` does (rows may be none); deviations are NaN.")
      .def(
          "finish", [](MotionFollower& follower) { return dict_of(follower.finish()); },
          "The rows that are left, as `push` returns them.");
  r.def("estimate_motion", &estimate, py::arg("scene"), py::arg("columns"), py::arg("recording"),
        py::kw_only(), py::arg("errors") = py::none(), py::arg("threads") = 0, kEstimateDoc);
}

}  // namespace counterpoint::python
