// counterpoint.live and Simulator.live: states in a browser while a program computes them.
#include <pybind11/stl.h>

#include <chrono>
#include <thread>

#include "live/viewer.h"
#include "objects/simulator_handle.h"

namespace counterpoint::python {
namespace {

struct LiveHandle {
  std::unique_ptr<live::Viewer> viewer;  ///< null once closed
  SimulatorPtr simulator;                ///< shown by show(); may be null

  live::Viewer& open() const {
    if (!viewer) throw py::value_error("this view is closed");
    return *viewer;
  }
  void close() {
    const py::gil_scoped_release release;
    viewer.reset();
  }
};

std::unique_ptr<live::Viewer> make_viewer(Scene scene, int port, const std::string& host) {
  if (port < 0 || port > 65535) throw py::value_error("port: expected 0 ... 65535");
  const py::gil_scoped_release release;
  return std::make_unique<live::Viewer>(std::move(scene), "",
                                        live::ServerOptions{host, port, false});
}

bool show_simulator(live::Viewer& viewer, SimulatorHandle& s, bool always) {
  const Guard::Lock lock(s.guard, kSimulator);
  const py::gil_scoped_release release;
  return viewer.show(s.simulator, always);
}

bool show_any(LiveHandle& view, const py::object& what, bool always) {
  live::Viewer& viewer = view.open();
  if (what.is_none()) {
    if (!view.simulator) throw py::type_error("show: expected a State or a Simulator");
    return show_simulator(viewer, *view.simulator, always);
  }
  if (py::isinstance<SimulatorHandle>(what))
    return show_simulator(viewer, *what.cast<SimulatorPtr>(), always);
  if (!py::isinstance<StateHandle>(what))
    throw py::type_error("show: expected a State or a Simulator");
  const State& state = what.cast<StatePtr>()->value();
  const py::gil_scoped_release release;
  return viewer.show(state, always);
}

/// Waits until a page looks. Returns whether one does.
bool wait_for_page(const LiveHandle& view, double seconds) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::duration<double>(std::min(seconds, 1e9));
  while (view.open().pages() == 0 && Clock::now() < end) {
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    const py::gil_scoped_release release;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return view.open().pages() > 0;
}

}  // namespace

// Long: one list of methods and functions with their texts.
void bind_live(py::module_& m) {
  py::class_<LiveHandle>(m, "LiveView", R"(
A page in a browser that shows states while a program computes them: made by `live` and
`Simulator.live`. A context manager, which closes it.
)")
      .def_property_readonly(
          "address", [](const LiveHandle& view) { return view.open().address(); },
          "Address of the page: open it in a browser.")
      .def_property_readonly(
          "pages", [](const LiveHandle& view) { return view.open().pages(); },
          "Number of pages that look at present.")
      .def("show", &show_any, py::arg("what") = py::none(), py::arg("always") = false, R"(
Shows a state, unless no page looks or the last one is younger than a 60th of a second. Returns at
once: no page is waited for.

Parameters
----------
what : State or Simulator, optional
    A simulator also shows the forces of closures and its inputs. Default: that of `Simulator.live`.
always : bool
    Show it even if the last one is younger.

Returns
-------
bool
    Whether it was sent.
)")
      .def("wait", &wait_for_page, py::arg("seconds") = 60.0,
           "Waits for a page, at most so long [s]. Returns whether there is one.")
      .def("close", &LiveHandle::close, "Ends the server; pages keep what they have.")
      .def("__enter__", [](py::object self) { return self; })
      .def("__exit__", [](LiveHandle& view, const py::args&) { view.close(); })
      .def("_repr_html_",
           [](const LiveHandle& view) {
             if (!view.viewer) return std::string("<pre>closed</pre>");
             const std::string& at = view.viewer->address();
             return "<a href=\"" + at + "\" target=\"_blank\">" + at + "</a>";
           })
      .def("__repr__", [](const LiveHandle& view) {
        return "<LiveView " + (view.viewer ? "at " + view.viewer->address() : "closed") + ">";
      });
  m.def(
      "live",
      [](const ScenePtr& scene, int port, const std::string& host) {
        return LiveHandle{make_viewer(scene->scene(), port, host), nullptr};
      },
      py::arg("scene"), py::kw_only(), py::arg("port") = 0, py::arg("host") = "127.0.0.1", R"(
Starts a server for a page that shows states of a scene as they come.

Parameters
----------
scene : Scene
port : int
    0: any free one.
host : str
    Address to listen at; any but 127.0.0.1 and ::1 needs the token in LiveView.address.

Returns
-------
LiveView

Examples
--------
>>> with cp.live(scene) as view:
...     print(view.address)
...     for state in states:
...         view.show(state)
)");
  const py::object simulator = m.attr("Simulator");
  simulator.attr("live") = py::cpp_function(
      [](const SimulatorPtr& s, int port, const std::string& host) {
        Scene scene = s->simulator.scene();
        scene.q = s->simulator.state().q;
        scene.v = s->simulator.state().v;
        return LiveHandle{make_viewer(std::move(scene), port, host), s};
      },
      py::is_method(simulator), py::name("live"), py::kw_only(), py::arg("port") = 0,
      py::arg("host") = "127.0.0.1",
      "As counterpoint.live, of this simulator: LiveView.show() shows its state and forces.");
}

}  // namespace counterpoint::python
