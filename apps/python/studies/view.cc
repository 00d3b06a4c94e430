// counterpoint.view: replays in a notebook or a file.
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "objects/trajectories.h"
#include "view/input_files.h"
#include "view/replay.h"

namespace counterpoint::python {
namespace {

/// Escapes text for an attribute value in double quotes.
std::string escaped(const std::string& text) {
  std::string out;
  out.reserve(text.size() + text.size() / 8);
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '"')
      out += "&quot;";
    else
      out += c;
  }
  return out;
}

std::string page(const ScenePtr& handle, const TrajectoryHandle& t, const TrajectoryPtr& ghost,
                 const std::string& title, double rate, bool contacts) {
  const Scene scene = handle->scene();
  const py::gil_scoped_release release;
  const auto clip = [&](const TrajectoryHandle& motion, bool forces) {
    return view::clip_of(scene, motion.trajectory, motion.trajectory.time_step, rate, forces);
  };
  const bool forces = contacts && !t.trajectory.time_step.empty();
  view::Replay replay;
  replay.title = title.empty() ? scene.name : title;
  replay.scene = &scene;
  replay.clip = clip(t, forces);
  if (ghost) replay.ghosts.push_back(clip(*ghost, false));
  replay.made = {{"made by", "counterpoint for Python " COUNTERPOINT_VERSION}};
  return view::replay_page(replay);
}

/// A motion to show.
struct ReplayHandle {
  ScenePtr scene;
  TrajectoryPtr trajectory, ghost;
  std::string title;
  double rate;
  bool contacts;
  int height;

  std::string html() const { return page(scene, *trajectory, ghost, title, rate, contacts); }
  std::string notebook() const {
    if (!view::can_make_pages()) return "<pre>" + escaped(view::why_no_pages()) + "</pre>";
    return "<iframe style=\"width:100%;border:0\" height=\"" + std::to_string(height) +
           "\" srcdoc=\"" + escaped(html()) + "\"></iframe>";
  }
};

ReplayHandle make_replay(const TrajectoryPtr& trajectory, const ScenePtr& scene,
                         const TrajectoryPtr& ghost, const std::string& title, double rate,
                         bool contacts, int height) {
  const ScenePtr shown = scene ? scene : trajectory->scene;
  if (!shown) throw py::type_error("Replay: of a trajectory that knows no scene, give one");
  if (shown->model->model.nq() != trajectory->trajectory.q.rows())
    throw py::value_error("Replay: the trajectory is of another model");
  return {shown, trajectory, ghost, title, rate, contacts, height};
}

}  // namespace

void bind_view(py::module_& m) {
  py::module_ v = m.def_submodule("view", "Replays: motions as HTML pages that play anywhere.");
  v.def("can_make_pages", &view::can_make_pages, "Is the page's program part of this build?");
  v.def("why_no_pages", &view::why_no_pages, "If not, why, and what to do.");
  py::class_<ReplayHandle>(v, "Replay", R"(
A motion to be looked at: shown by a notebook as it is, or saved as one HTML page.

Parameters
----------
trajectory : Trajectory
scene : Scene, optional
    Default: the trajectory's own.
ghost : Trajectory, optional
    A second motion of the same scene, shown beside.
title : str
rate : float
    Frames a second; 0: every row.
contacts : bool
    Contact forces are recovered from the motion.
height : int
    In a notebook [pixels].
)")
      .def(py::init(&make_replay), py::arg("trajectory"), py::arg("scene").none(true) = py::none(),
           py::kw_only(), py::arg("ghost").none(true) = py::none(), py::arg("title") = "",
           py::arg("rate") = view::kDefaultRate, py::arg("contacts") = true,
           py::arg("height") = 640)
      .def("html", &ReplayHandle::html,
           "The whole page. Raises InputError where can_make_pages() is false.")
      .def(
          "save",
          [](const ReplayHandle& r, const std::filesystem::path& file) {
            const std::string page = r.html();
            const py::gil_scoped_release release;
            view::write_whole(file, page);
          },
          py::arg("file"), "Writes the page.")
      .def("_repr_html_", &ReplayHandle::notebook)
      .def("__repr__", [](const ReplayHandle& r) {
        return py::str("<Replay of '{}', {} rows>")
            .format(r.scene->name, r.trajectory->trajectory.num_rows());
      });
  // A trajectory at the end of a notebook cell displays itself.
  const py::object trajectory = m.attr("Trajectory");
  trajectory.attr("_repr_html_") = py::cpp_function(
      [](const TrajectoryPtr& t) -> py::object {
        if (!t->scene) return py::none();
        return py::cast(
            make_replay(t, nullptr, nullptr, "", view::kDefaultRate, true, 640).notebook());
      },
      py::is_method(trajectory), py::name("_repr_html_"));
}

}  // namespace counterpoint::python
