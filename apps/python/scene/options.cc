// Simulation options of a scene.
#include <pybind11/stl.h>

#include "counterpoint/model/scene.h"
#include "objects/typed.h"
#include "objects/words.h"

namespace counterpoint::python {
namespace {

using EffectNames = Typed<py::frozenset, "FrozenSet[str]">;

EffectNames effect_names(const EffectSet& effects) {
  py::set names;
  for (int i = 0; i < kNumEffects; ++i)
    if (effects.has(static_cast<Effect>(i))) names.add(effect_name(static_cast<Effect>(i)));
  return EffectNames(py::frozenset(names));
}

Effect effect_from(const std::string& name) {
  return from_word<Effect>(name, "effect", effect_from_name, effect_name, kNumEffects);
}

/// Text for repr(): "SimulationOptions(time_step=0.002, ...)".
std::string repr(const char* type, const py::object& object,
                 std::initializer_list<const char*> names) {
  std::string text = std::string(type) + "(";
  for (const char* name : names)
    text += (text.back() == '(' ? "" : ", ") + std::string(name) + "=" +
            py::repr(object.attr(name)).cast<std::string>();
  return text + ")";
}

/// A constructor that sets attributes by keyword.
template <class T>
auto from_keywords(const char* type) {
  return py::init([type](const py::kwargs& values) {
    T made;
    const py::object object = py::cast(&made, py::return_value_policy::reference);
    for (const std::pair<py::handle, py::handle> item : values) {
      if (!py::hasattr(object, item.first))
        throw py::type_error(std::string(type) + ": no attribute '" +
                             item.first.cast<std::string>() + "'");
      object.attr(item.first) = item.second;
    }
    return made;
  });
}

void bind_contact_options(py::module_& m) {
  using C = ContactOptions;
  py::class_<C>(m, "ContactOptions", R"(
Everything that shapes the physics of contact; the inverse must be given what the step was given.

Parameters
----------
**values
    Any of the attributes.
)")
      .def(from_keywords<C>("ContactOptions"))
      .def_property(
          "friction_model", [](const C& c) { return friction_model_name(c.friction_model); },
          [](C& c, const std::string& word) {
            c.friction_model = from_word<FrictionModel>(
                word, "friction_model", friction_model_from_name, friction_model_name, 3);
          },
          "convex, lagged or coulomb.")
      .def_readwrite("compliance", &C::compliance,
                     "Regularizer over the inverse mass at the contact [-].")
      .def_readwrite("smoothing", &C::smoothing,
                     "As a length [m]: a resting body hovers about as high.")
      .def_readwrite("stabilization", &C::stabilization,
                     "Share of a penetration to be recovered in one step, 0 to 1 [-].")
      .def_readwrite("max_recovery_speed", &C::max_recovery_speed, "Of a penetration [m/s].")
      .def_readwrite("margin", &C::margin, "Contacts exist up to this gap [m] at most.")
      .def_readwrite("reach_acceleration", &C::reach_acceleration,
                     "What applied forces may add to velocities within a step [m/s^2].")
      .def_readwrite("slip_time", &C::slip_time,
                     "Coulomb friction slips by time_step / slip_time of what moves [s].")
      .def(
          "apply_preset",
          [](C& c, const std::string& word) {
            apply_contact_preset(from_word<ContactPreset>(word, "preset", contact_preset_from_name,
                                                          contact_preset_name, 3),
                                 c);
          },
          py::arg("preset"), R"(
Sets friction_model and compliance.

Parameters
----------
preset : {'fast', 'default', 'hard'}
)")
      .def("__eq__", [](const C& a, const C& b) { return a == b; })
      .def("__repr__", [](const py::object& self) {
        return repr("ContactOptions", self,
                    {"friction_model", "compliance", "smoothing", "stabilization",
                     "max_recovery_speed", "margin", "reach_acceleration", "slip_time"});
      });
}

void bind_step_control(py::module_& m) {
  using S = StepControlOptions;
  py::class_<S>(m, "StepControlOptions", R"(
Steps as long as their error allows, in place of time_step.

Parameters
----------
**values
    Any of the attributes.
)")
      .def(from_keywords<S>("StepControlOptions"))
      .def_readwrite("tolerance", &S::tolerance,
                     "Error that a second of motion may add, of any coordinate [m/s, rad/s].")
      .def_readwrite("relative_tolerance", &S::relative_tolerance,
                     "The same as a share of the coordinate's speed [-], in addition.")
      .def_readwrite("event_tolerance", &S::event_tolerance,
                     "The step that an impact falls into is no longer than this [s].")
      .def_readwrite("min_step", &S::min_step, "[s]")
      .def_readwrite("max_step", &S::max_step, "[s]")
      .def_readwrite("interval", &S::interval,
                     "Steps end at every multiple of this time [s]; 0: wherever they do.")
      .def_readwrite("strict", &S::strict,
                     "A step of min_step whose error is above the tolerance fails.")
      .def("__eq__", [](const S& a, const S& b) { return a == b; })
      .def("__repr__", [](const py::object& self) {
        return repr("StepControlOptions", self,
                    {"tolerance", "relative_tolerance", "event_tolerance", "min_step", "max_step",
                     "interval", "strict"});
      });
}

void bind_effects(py::class_<SimulationOptions>& options) {
  using O = SimulationOptions;
  options
      .def_property(
          "effects", [](const O& o) { return effect_names(o.effects); },
          [](O& o, const Typed<py::iterable, "Iterable[str]">& names) {
            EffectSet set;
            for (const py::handle name : names)
              set.set(effect_from(name.cast<std::string>()), true);
            o.effects = set;
          },
          "Effects that are on where the scene calls for them: a frozenset of names "
          "(docs/explanation/effects.md).")
      .def(
          "switch_effect",
          [](O& o, const std::string& name, bool on) { o.effects.set(effect_from(name), on); },
          py::arg("name"), py::arg("on"), "Switches one effect on or off.");
}

}  // namespace

void bind_options(py::module_& m) {
  bind_contact_options(m);
  bind_step_control(m);
  using O = SimulationOptions;
  py::class_<O> options(m, "SimulationOptions", R"(
How a scene is stepped.

Parameters
----------
**values
    Any of the attributes.
)");
  options.def(from_keywords<O>("SimulationOptions"))
      .def_readwrite("time_step", &O::time_step, "[s]")
      .def_property(
          "integrator", [](const O& o) { return integrator_name(o.integrator); },
          [](O& o, const std::string& word) {
            o.integrator =
                from_word<Integrator>(word, "integrator", integrator_from_name, integrator_name, 3);
          },
          "semi_implicit_euler, implicit_midpoint or runge_kutta_4.")
      .def_readwrite("duration", &O::duration, "What the scene asks for [s]; no step looks at it.")
      .def_readwrite("max_speed", &O::max_speed,
                     "A step fails that leaves a coordinate faster than this [m/s].")
      .def_readwrite("closing_time", &O::closing_time,
                     "A closure that stays open, and comes no closer, this long [s] is named in "
                     "the step's report.")
      .def_readwrite("step_budget", &O::step_budget,
                     "Newton steps after which a step is left unfinished; 0: no bound.")
      .def_readwrite("contact", &O::contact, "ContactOptions.")
      .def_readwrite("mean_velocity_forces", &O::mean_velocity_forces,
                     "Velocity-dependent forces are those in the middle of the step; False: those "
                     "at its start.")
      .def_property(
          "step_control", [](O& o) { return o.step_control ? &*o.step_control : nullptr; },
          [](O& o, const std::optional<StepControlOptions>& c) { o.step_control = c; },
          py::return_value_policy::reference_internal, "StepControlOptions, or None.");
  bind_effects(options);
  options.def("__eq__", [](const O& a, const O& b) { return a == b; })
      .def("__copy__", [](const O& o) { return O(o); })
      .def(
          "copy", [](const O& o) { return O(o); }, "A copy of its own.")
      .def("__repr__", [](const py::object& self) {
        return repr("SimulationOptions", self,
                    {"time_step", "integrator", "duration", "max_speed", "closing_time",
                     "step_budget", "contact", "mean_velocity_forces", "step_control"});
      });
}

}  // namespace counterpoint::python
