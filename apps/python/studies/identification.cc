// counterpoint.recordings: parameters of a scene by name, and their identification from recordings.
#include <pybind11/functional.h>
#include <pybind11/stl.h>

#include <numeric>

#include "counterpoint/engine/estimate/identifiability.h"
#include "counterpoint/engine/estimate/parameter_estimate.h"
#include "counterpoint/engine/estimate/torque_fit.h"
#include "objects/handles.h"
#include "objects/properties.h"
#include "objects/typed.h"
#include "recordings/estimation.h"

namespace counterpoint::python {
namespace {

using apps::ColumnMap;
using apps::Fit;
using apps::FittedParameter;
using apps::Parameter;
using apps::Recording;
using Bounds = std::optional<std::pair<double, double>>;

struct FoundHandle {
  std::string name, unit;
  double scene;
  FittedParameter found;
};

struct IdentificationHandle {
  std::vector<FoundHandle> parameters;
  Fit fit;
  ScenePtr scene;
  estimation::Identifiability told;
};

Bounds bounds(const std::optional<apps::Interval>& interval) {
  if (!interval) return std::nullopt;
  return std::pair(interval->lower, interval->upper);
}

/// Returns a function, called from time to time, that checks for signals and calls the user's
/// function.
std::function<void(int, int)> watch(const py::object& progress) {
  return [&progress](int done, int total) {
    const py::gil_scoped_acquire acquire;
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    if (!progress.is_none()) progress(done, total);
  };
}

apps::Experiment experiment_from(const SceneHandle& scene, const ColumnMap& map,
                                 const std::vector<std::shared_ptr<Recording>>& recordings,
                                 const std::string& objective, std::optional<int> substeps,
                                 int horizon) {
  if (objective != "score" && objective != "rows" && objective != "one-step" &&
      objective != "force" && objective != "torque" && objective != "explain")
    throw py::value_error(
        "objective '" + objective +
        "': expected 'score', 'rows', 'one-step', 'force', 'torque' or 'explain'");
  if (compared(map) == apps::Compared::kImpacts &&
      (objective == "force" || objective == "torque" || objective == "explain"))
    throw py::value_error("objective '" + objective +
                          "': an impact takes no time, forces are not to be had");
  apps::Experiment e{scene.scene(), map, {}, 0, {}};
  e.prediction = {substeps ? substeps : map.substeps, e.scene.options.time_step,
                  objective == "one-step" ? 1 : horizon};
  e.by_score = objective == "score";
  e.reach = e.scene.options.contact.margin;
  for (const auto& recording : recordings) e.recordings.push_back(*recording);
  e.num_given = static_cast<int>(e.recordings.size());
  return e;
}

/// Finds parameters and motions that explain the recordings. Calls `progress`, which may raise,
/// before each Newton step with the number of steps; their total is unknown and passed as 0.
Fit explained_best(const apps::Experiment& e, const std::vector<Parameter>& parameters,
                   const std::function<void(int, int)>& progress) {
  std::vector<const Recording*> recordings;
  for (const Recording& one : e.recordings) recordings.push_back(&one);
  estimation::MotionEstimateOptions options;
  int steps = 0;
  options.stop = [&] {
    progress(steps++, 0);
    return false;
  };
  return estimation::estimate_parameters(e.scene, e.map, recordings, parameters, options)
      .parameters;
}

/// Fits recorded joint forces. Calls `progress`, which may raise, before each recording of a pass
/// with the number of recordings so far; their total is unknown and passed as 0.
Fit torques_best(const apps::Experiment& e, const std::vector<Parameter>& parameters, double cutoff,
                 double rest_speed, const std::function<void(int, int)>& progress) {
  std::vector<const Recording*> recordings;
  for (const Recording& one : e.recordings) recordings.push_back(&one);
  estimation::TorqueFitOptions options{cutoff, rest_speed, 0};
  int passed = 0;
  options.stop = [&] {
    progress(passed++, 0);
    return false;
  };
  return estimation::fit_torques(e.scene, e.map, recordings, parameters, options).parameters;
}

std::shared_ptr<IdentificationHandle> identify(
    const SceneHandle& scene, const ColumnMap& map,
    const std::vector<std::shared_ptr<Recording>>& recordings, const std::string& text,
    const std::string& objective, std::optional<int> substeps, int horizon, bool robust,
    int samples, int refined, int bootstrap, bool exact, double difference, double cutoff,
    double rest_speed, const py::object& progress) {
  const apps::Experiment e = experiment_from(scene, map, recordings, objective, substeps, horizon);
  const std::vector<Parameter> parameters = apps::parse_parameters(text, e.scene);
  std::vector<int> all(e.recordings.size());
  std::iota(all.begin(), all.end(), 0);
  apps::FitOptions options;
  options.samples = samples;
  options.refined = refined;
  options.robust = robust;
  options.bootstrap = bootstrap;
  options.exact = exact;
  options.difference = difference;
  options.progress = watch(progress);
  auto out = std::make_shared<IdentificationHandle>();
  {
    const py::gil_scoped_release release;
    if (objective == "torque") {
      out->fit = torques_best(e, parameters, cutoff, rest_speed, options.progress);
    } else if (objective == "explain") {
      out->fit = explained_best(e, parameters, options.progress);
    } else {
      out->fit = fit(apps::fit_problem(e, parameters, all, objective == "force"), options);
    }
    if (!out->fit.stopped) out->told = estimation::identifiability(parameters, out->fit);
    out->scene = handle_of(with_parameters(e.scene, parameters, out->fit.values()));
  }
  const VectorX start = apps::parameter_values(parameters, e.scene);
  for (size_t i = 0; i < parameters.size(); ++i)
    out->parameters.push_back({parameters[i].name, parameters[i].unit,
                               start[static_cast<Eigen::Index>(i)], out->fit.parameters[i]});
  return out;
}

void bind_found(py::module_& r) {
  using F = FoundHandle;
  py::class_<F>(r, "FoundParameter", "A figure of a scene, found from recordings.")
      .def_readonly("name", &F::name, "KIND or KIND:ELEMENT.")
      .def_readonly("unit", &F::unit, "SI.")
      .def_readonly("scene", &F::scene, "What the scene had.")
      .def_property_readonly("value", through(&F::found, &FittedParameter::value),
                             "What was found.")
      .def_property_readonly(
          "interval", [](const F& f) { return bounds(f.found.interval); },
          "95 %, by derivatives: (lower, upper); None where it cannot be identified.")
      .def_property_readonly(
          "bootstrap", [](const F& f) { return bounds(f.found.bootstrap); },
          "95 %, percentiles of the refits: (lower, upper), or None.")
      .def_property_readonly("at_bound", through(&F::found, &FittedParameter::at_bound),
                             "Is it as far as it may go?")
      .def("__repr__", [](const F& f) {
        return py::str("<FoundParameter {}: {:.6g} {} (scene {:.6g})>")
            .format(f.name, f.found.value, f.unit, f.scene);
      });
  using I = IdentificationHandle;
  py::class_<I, std::shared_ptr<I>>(r, "Identification",
                                    "Figures found, and the scene that has them.")
      .def_readonly("parameters", &I::parameters, "List of FoundParameter.")
      .def_readonly("scene", &I::scene, "Scene with these figures.")
      .def_property_readonly("start_cost", through(&I::fit, &Fit::start_cost),
                             "Sum of the loss over the recordings, as the scene was.")
      .def_property_readonly("cost", through(&I::fit, &Fit::cost), "The same, as found.")
      .def_property_readonly("evaluations", through(&I::fit, &Fit::evaluations),
                             "Of all residuals.")
      .def_property_readonly("linearizations", through(&I::fit, &Fit::linearizations),
                             "Of all residuals, with exact derivatives.")
      .def_property_readonly(
          "correlation", [](const I& i) { return copy_matrix(i.fit.correlation); },
          "Of the estimates, shape (n, n).")
      .def_property_readonly(
          "covariance", [](const I& i) { return copy_matrix(i.fit.covariance); },
          "Of the values, shape (n, n); meaningful where they have intervals.")
      .def_property_readonly(
          "untold",
          [](const I& i) {
            std::vector<std::string> words;
            for (const auto& direction : i.told.untold) words.push_back(direction.words);
            return words;
          },
          "Sentences on the combinations of parameters that the recordings do not tell.")
      .def_property_readonly(
          "spectrum",
          [](const I& i) {
            return std::vector<double>(i.told.spectrum.begin(), i.told.spectrum.end());
          },
          "Singular values of the sensitivity, descending, in standard deviations of "
          "the noise over the range of a parameter.")
      .def("__repr__", [](const I& i) {
        std::string text = "<Identification:";
        for (const FoundHandle& f : i.parameters)
          text += py::str(" {}={:.6g}").format(f.name, f.found.value).cast<std::string>();
        return text + ">";
      });
}

}  // namespace

constexpr const char* kIdentifyDoc = R"(
Looks for figures of a scene with which it predicts recordings best, as `counterpoint identify` does.

Parameters
----------
scene : Scene
columns : ColumnMap
recordings : sequence of Recording
    All are fitted; score others with predict.
parameters : str
    What to find: KIND[:ELEMENT[+ELEMENT...]][=LOW..HIGH][~DEVIATION], comma separated, or @FILE.yaml
    (docs/reference/recording-format.md).
objective : {'score', 'rows', 'one-step', 'force', 'torque', 'explain'}
    What is made small. 'torque' fits recorded joint forces; of the settings below it takes cutoff,
    rest_speed and progress. 'explain' finds the motions behind noisy recordings with the figures, from
    the scene's own as start; it takes none of the settings below but progress.
substeps : int, optional
    Time steps between two rows.
horizon : int
    Start anew from the recording every so many rows; 0: its first row only.
robust : bool
    Recordings far off count less (Cauchy's loss); else plain squares.
samples : int
    Points tried before any is refined.
refined : int
    Points refined.
bootstrap : int
    Refits to recordings drawn anew.
exact : bool
    Exact derivatives where steps have closed forms; else differences of all.
difference : float
    Last step of the differences, as a share of the range.
cutoff : float
    Of 'torque': -3 dB frequency of the filter of forces [Hz].
rest_speed : float
    Of 'torque': slower joints with dry friction rest [rad/s, m/s].
progress : Callable[[int, int], object], optional
    Called with the numbers of what is done and of all.

Returns
-------
Identification
)";

void bind_identification(py::module_& r) {
  bind_found(r);
  r.def(
      "with_settings",
      [](const SceneHandle& scene, const std::string& settings) {
        return handle_of(apps::with_settings(scene.scene(), settings));
      },
      py::arg("scene"), py::arg("settings"),
      "A Scene with other figures, KIND[:ELEMENT]=VALUE,... (docs/guide/recordings.md): a model "
      "anew.");
  r.def(
      "parameter_values",
      [](const SceneHandle& handle, const std::string& text) {
        const Scene scene = handle.scene();
        const std::vector<Parameter> parameters = apps::parse_parameters(text, scene);
        const VectorX values = apps::parameter_values(parameters, scene);
        NumbersByName out;
        for (size_t i = 0; i < parameters.size(); ++i)
          out[py::str(parameters[i].name)] = values[static_cast<Eigen::Index>(i)];
        return out;
      },
      py::arg("scene"), py::arg("parameters"), "Figures of a scene by name, KIND[:ELEMENT],...");
  const apps::FitOptions defaults;
  r.def("identify", &identify, py::arg("scene"), py::arg("columns"), py::arg("recordings"),
        py::arg("parameters"), py::kw_only(), py::arg("objective") = "score",
        py::arg("substeps") = py::none(), py::arg("horizon") = 0,
        py::arg("robust") = defaults.robust, py::arg("samples") = defaults.samples,
        py::arg("refined") = defaults.refined, py::arg("bootstrap") = defaults.bootstrap,
        py::arg("exact") = defaults.exact, py::arg("difference") = defaults.difference,
        py::arg("cutoff") = 10.0, py::arg("rest_speed") = 0.0, py::arg("progress") = py::none(),
        kIdentifyDoc);
}

}  // namespace counterpoint::python
