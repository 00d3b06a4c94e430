// counterpoint.recordings: compares recorded motions with a scene.
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "objects/exceptions.h"
#include "objects/handles.h"
#include "objects/typed.h"
#include "recordings/estimation.h"

namespace counterpoint::python {
namespace {

using apps::ColumnMap;
using apps::Prediction;
using apps::Recording;
using MapPtr = std::shared_ptr<ColumnMap>;
using RecordingPtr = std::shared_ptr<Recording>;
using PredictionPtr = std::shared_ptr<Prediction>;
using Explanation = Typed<py::dict, "_Explanation">;

NumbersByName dict_of(const std::vector<std::pair<const char*, double>>& metrics) {
  NumbersByName out;
  for (const auto& [name, value] : metrics) out[name] = value;
  return out;
}

std::vector<RecordingPtr> read_recordings_of(const std::vector<std::filesystem::path>& files,
                                             const ColumnMap& columns, const SceneHandle& scene,
                                             const std::map<std::string, std::string>& sources,
                                             bool missing_cells) {
  ColumnMap map = columns;
  map.missing_cells = missing_cells;
  std::vector<RecordingPtr> out;
  for (const std::filesystem::path& file : files)
    for (Recording& one : reading(file, [&] {
           return read_recordings(file, map, scene.model->model, scene.q, scene.v);
         }))
      out.push_back(std::make_shared<Recording>(std::move(one)));
  if (out.size() > 1 && !sources.empty())
    throw py::value_error("sources: their files go with one recording");
  for (const RecordingPtr& one : out)
    if (!sources.empty()) apps::read_sources(sources, map, *one);
  return out;
}

std::vector<PredictionPtr> predict(const SceneHandle& handle, const ColumnMap& map,
                                   const std::vector<RecordingPtr>& recordings,
                                   std::optional<int> substeps, int horizon) {
  if (substeps && *substeps < 1) throw py::value_error("substeps: expected 1 or more");
  apps::refuse_sensors(map, "predict", true);
  const apps::PredictionOptions options{substeps ? substeps : map.substeps,
                                        handle.options.time_step, horizon};
  const Scene scene = handle.scene();
  std::vector<PredictionPtr> out;
  const py::gil_scoped_release release;
  apps::Predictor predictor(scene, map, options);
  for (const RecordingPtr& recording : recordings)
    out.push_back(std::make_shared<Prediction>(predictor.predict(*recording)));
  return out;
}

/// Returns, by recording, the figures and forces by step that no contact can explain.
std::vector<Explanation> explain(const SceneHandle& handle, const ColumnMap& map,
                                 const std::vector<RecordingPtr>& recordings,
                                 std::optional<double> reach) {
  if (compared(map) == apps::Compared::kImpacts)
    throw py::value_error("an impact takes no time, forces are not to be had");
  apps::refuse_sensors(map, "explain");
  const Scene scene = handle.scene();
  std::vector<apps::ExplainedRecording> found;
  {
    const py::gil_scoped_release release;
    apps::Explainer explainer(scene, map, reach.value_or(scene.options.contact.margin));
    for (const RecordingPtr& recording : recordings)
      found.push_back(explain_recording(explainer, map, *recording));
  }
  std::vector<Explanation> out;
  for (const apps::ExplainedRecording& one : found) {
    const auto steps = static_cast<Eigen::Index>(one.steps.size());
    MatrixX force(scene.model.nv(), steps);
    for (Eigen::Index k = 0; k < steps; ++k) force.col(k) = one.steps[static_cast<size_t>(k)].force;
    Explanation entry;
    entry["file"] = one.file;
    entry["time"] = py::array_t<double>(static_cast<py::ssize_t>(one.time.size()), one.time.data());
    entry["force"] = copy_matrix(force, true);
    entry["figures"] = dict_of(one.metrics);
    out.push_back(entry);
  }
  return out;
}

void bind_map_and_recording(py::module_& r) {
  py::class_<ColumnMap, MapPtr>(r, "ColumnMap", "Which column of a recording is which coordinate.")
      .def_property_readonly(
          "names", [](const ColumnMap& map) { return names_of(map.entries); },
          "Coordinates that the recording feeds, as in a trajectory.")
      .def_property_readonly(
          "compared",
          [](const ColumnMap& map) {
            const apps::Compared by = compared(map);
            return by == apps::Compared::kJoints ? "joints"
                   : by == apps::Compared::kPose ? "pose"
                                                 : "impacts";
          },
          "What predictions and recordings are compared by: joints, pose or impacts.")
      .def("__repr__", [](const ColumnMap& map) {
        return py::str("<ColumnMap: {} columns>").format(map.entries.size());
      });
  py::class_<Recording, RecordingPtr>(
      r, "Recording", "A recorded motion as coordinates of a scene; arrays are views, read-only.")
      .def_readonly("file", &Recording::file, "File it came from, and which part of it.")
      .def_property_readonly(
          "time", [](const RecordingPtr& x) { return view(x->time, py::cast(x)); },
          "[s], shape (rows,).")
      .def_property_readonly(
          "q", [](const RecordingPtr& x) { return view_columns(x->q, py::cast(x)); },
          "Shape (rows, nq); what the map does not name is the scene's start.")
      .def_property_readonly(
          "v", [](const RecordingPtr& x) { return view_columns(x->v, py::cast(x)); },
          "[m/s, rad/s], shape (rows, nv).")
      .def_property_readonly(
          "applied_force",
          [](const RecordingPtr& x) { return view_columns(x->applied_force, py::cast(x)); },
          "[N, N m], shape (rows, nv).")
      .def("__len__", [](const Recording& x) { return x.num_rows(); })
      .def("__repr__", [](const Recording& x) {
        return py::str("<Recording '{}': {} rows>").format(x.file, x.num_rows());
      });
}

void bind_prediction(py::module_& r) {
  py::class_<Prediction, PredictionPtr>(
      r, "Prediction",
      "A recording predicted by simulation, and how far off; arrays are views, read-only.")
      .def_readonly("file", &Prediction::file, "Of the recording.")
      .def_property_readonly(
          "q", [](const PredictionPtr& p) { return view_columns(p->q, py::cast(p)); },
          "Shape (rows, nq); as recorded where a piece starts.")
      .def_property_readonly(
          "sensors", [](const PredictionPtr& p) { return view_columns(p->sensors, py::cast(p)); },
          "Shape (rows, columns of the map's sensors), in their units; NaN in the last row.")
      .def_property_readonly(
          "time", [](const PredictionPtr& p) { return view(p->time, py::cast(p)); },
          "Of the rows predicted [s].")
      .def_property_readonly(
          "deviations",
          [](const Prediction& p) {
            py::array_t<double> out(
                {static_cast<py::ssize_t>(p.deviations.size()), py::ssize_t{3}});
            double* row = out.mutable_data();
            for (const apps::Deviation& d : p.deviations)
              for (const double x : {d.position, d.rotation, d.joints}) *row++ = x;
            return out;
          },
          "At the rows predicted, shape (n, 3): position [m], rotation [degrees], joints [rad or "
          "m].")
      .def_readonly("steps", &Prediction::steps, "Of the simulation.")
      .def_property_readonly(
          "succeeded", [](const Prediction& p) { return !p.failure; }, "Did all steps?")
      .def(
          "figures",
          [](const PredictionPtr& p, const ColumnMap& map) {
            return dict_of(metrics(*p, compared(map)));
          },
          py::arg("columns"), "The figures of `counterpoint compare` by name.")
      .def("__repr__", [](const Prediction& p) {
        return py::str("<Prediction of '{}', {} rows>").format(p.file, p.rows);
      });
}

}  // namespace

void bind_identification(py::module_& r);   // identification.cc
void bind_motion_estimate(py::module_& r);  // motion_estimate.cc

constexpr const char* kLoadColumnMapDoc = R"(
Reads a column map (YAML, docs/guide/recordings.md).

Parameters
----------
file : path
model : Model

Returns
-------
ColumnMap
)";

constexpr const char* kReadRecordingsDoc = R"(
Reads recordings through a map; a file may give several.

Parameters
----------
files : sequence of path
columns : ColumnMap
scene : Scene
    Its start is taken where the map names nothing.
sources : dict of str to path, optional
    Files of the map's `sources`, by name (`estimate_motion`); they go with one recording.
missing_cells : bool
    Empty cells of positions are interpolated, and not measured (`estimate_motion`), else errors.

Returns
-------
list of Recording
)";

constexpr const char* kPredictDoc = R"(
Predicts recordings by simulation, from their first rows or anew every few rows.

Parameters
----------
scene : Scene
columns : ColumnMap
recordings : sequence of Recording
substeps : int, optional
    Time steps from row to row; default: the map's, else as near the scene's as can be.
horizon : int
    Every so many rows the recording is taken anew as the start; 0: its first row only.

Returns
-------
list of Prediction
)";

constexpr const char* kExplainDoc = R"(
Forces behind recorded motions, and how much of them no contact can have given.

Parameters
----------
scene : Scene
columns : ColumnMap
recordings : sequence of Recording
reach : float, optional
    Contacts up to this gap [m] may push; default: the scene's margin.

Returns
-------
list of dict
    'file', 'time' (steps,), 'force' (steps, nv) [N, N m], 'figures' by name.
)";

void bind_recordings(py::module_& m) {
  py::module_ r =
      m.def_submodule("recordings", "Real motions: prediction, comparison, identification.");
  bind_map_and_recording(r);
  bind_prediction(r);
  r.def(
      "load_column_map",
      [](const std::filesystem::path& file, const ModelHandle& model) {
        return std::make_shared<ColumnMap>(
            reading(file, [&] { return apps::load_column_map(file, model.model); }));
      },
      py::arg("file"), py::arg("model"), kLoadColumnMapDoc);
  r.def("read_recordings", &read_recordings_of, py::arg("files"), py::arg("columns"),
        py::arg("scene"), py::kw_only(), py::arg("sources") = std::map<std::string, std::string>(),
        py::arg("missing_cells") = false, kReadRecordingsDoc);
  r.def("predict", &predict, py::arg("scene"), py::arg("columns"), py::arg("recordings"),
        py::kw_only(), py::arg("substeps") = py::none(), py::arg("horizon") = 0, kPredictDoc);
  r.def("explain", &explain, py::arg("scene"), py::arg("columns"), py::arg("recordings"),
        py::kw_only(), py::arg("reach") = py::none(), kExplainDoc);
  bind_motion_estimate(r);
  bind_identification(r);
}

}  // namespace counterpoint::python
