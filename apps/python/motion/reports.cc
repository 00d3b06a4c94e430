// Reports of steps and results of inverses.
#include "reports.h"

#include <pybind11/stl.h>

#include "counterpoint/model/scene.h"
#include "counterpoint/model/spatial.h"
#include "objects/exceptions.h"
#include "objects/properties.h"
#include "report/failure.h"

namespace counterpoint::python {
namespace {

struct FaultHandle {
  ModelPtr model;
  Fault fault;
};

struct ContactPart {
  ModelPtr model;
  ContactForce contact;
  const std::string& geometry(int index) const {
    return model->model.geometries()[static_cast<size_t>(index)].name;
  }
};

std::optional<FaultHandle> fault_of(const ModelPtr& model, const Fault& fault) {
  if (!fault.any()) return std::nullopt;
  return FaultHandle{model, fault};
}

void bind_fault(py::module_& m) {
  const auto text = [](const FaultHandle& f) { return describe(f.model->model, f.fault); };
  py::class_<FaultHandle>(m, "Fault", "Why a step could not be done, and where.")
      .def_property_readonly(
          "kind", [](const FaultHandle& f) { return fault_kind_name(f.fault.kind); },
          "applied_force, singular_inertia, unsolved, speed ...")
      .def_property_readonly(
          "element", [text](const FaultHandle& f) { return text(f).element; },
          "Name in the model: 'elbow.u', 'cube/body', 'ball/0 - ground'.")
      .def_property_readonly(
          "reason", [text](const FaultHandle& f) { return text(f).reason; }, "What is wrong.")
      .def_property_readonly(
          "advice", [text](const FaultHandle& f) { return text(f).advice; }, "What to do.")
      .def_property_readonly("value", through(&FaultHandle::fault, &Fault::value),
                             "Of what is named, SI.")
      .def_property_readonly("bound", through(&FaultHandle::fault, &Fault::bound),
                             "In force, SI; 0 where there is none.")
      .def_property_readonly("coordinate", through(&FaultHandle::fault, &Fault::coordinate),
                             "Index into q for positions, else into v; -1: none.")
      .def("__repr__", [text](const FaultHandle& f) {
        return "<Fault: " + text(f).reason + "; " + text(f).advice + ">";
      });
}

void bind_step_report(py::module_& m) {
  using R = ReportHandle;
  py::class_<R>(m, "StepReport", "What a step says of itself.")
      .def_property_readonly(
          "status", [](const R& r) { return status_name(r.report.status); },
          "converged, roundoff_floor, softened, or why it failed.")
      .def_property_readonly("succeeded", through(&R::report, &StepReport::succeeded),
                             "May the result be used?")
      .def("__bool__", [](const R& r) { return r.report.succeeded(); })
      .def_property_readonly("contacts", through(&R::report, &StepReport::contacts),
                             "Contact candidates given to the solver.")
      .def_property_readonly("constraint_rows", through(&R::report, &StepReport::constraint_rows),
                             "Of contacts, closures, limits, dry friction and mimics.")
      .def_property_readonly("newton_iterations",
                             through(&R::report, &StepReport::newton_iterations), "Of the solver.")
      .def_property_readonly("residual", through(&R::report, &StepReport::residual),
                             "Relative, see contact.Settings.tolerance.")
      .def_property_readonly("max_penetration", through(&R::report, &StepReport::max_penetration),
                             "At the start of the step [m].")
      .def_property_readonly("sleeping_bodies", through(&R::report, &StepReport::sleeping_bodies),
                             "Left out: nothing moves there.")
      .def_property_readonly(
          "softening",
          [](const R& r) { return std::pair(r.report.softening.factor, r.report.softening.tree); },
          "(factor, tree) of laws softer than their own; factor 1: none.")
      .def_property_readonly(
          "taut_links", through(&R::report, &StepReport::taut_links),
          "How many light links under tension turned more slowly than they would.")
      .def_property_readonly("largest_inertia", through(&R::report, &StepReport::largest_inertia),
                             "Of these, times their own.")
      .def_property_readonly(
          "fault", [](const R& r) { return fault_of(r.model, r.report.fault); }, "Fault, or None.")
      .def_property_readonly("message", &message_of,
                             "What a command would say of it; empty if it succeeded.")
      .def(
          "check", [](const R& r) { check(r); }, "Raises StepError if the step failed.")
      .def("__repr__", [](const R& r) {
        return py::str("<StepReport {}: {} contacts, {} Newton iterations>")
            .format(r.report.succeeded() ? status_name(r.report.status) : message_of(r).c_str(),
                    r.report.contacts, r.report.newton_iterations);
      });
}

void bind_controlled_report(py::module_& m) {
  using R = ControlledReportHandle;
  py::class_<R>(m, "ControlledReport", "What a controlled step, two halves, came to.")
      .def_property_readonly(
          "first",
          [](const R& r) {
            return ReportHandle{r.model, r.report.first};
          },
          "StepReport of the first half.")
      .def_property_readonly(
          "second",
          [](const R& r) {
            return ReportHandle{r.model, r.report.second};
          },
          "StepReport of the second half, which says whether the step succeeded.")
      .def_property_readonly("succeeded", through(&R::report, &ControlledReport::succeeded),
                             "May the result be used?")
      .def_property_readonly("step", through(&R::report, &ControlledReport::step),
                             "Both halves [s].")
      .def_property_readonly("error", through(&R::report, &ControlledReport::error),
                             "Over what is allowed [-].")
      .def_property_readonly("rejected", through(&R::report, &ControlledReport::rejected),
                             "Lengths that were tried before this one.")
      .def_property_readonly("evaluations", through(&R::report, &ControlledReport::evaluations),
                             "Steps computed.")
      .def_property_readonly("impact", through(&R::report, &ControlledReport::impact),
                             "A force was switched on within event_tolerance.")
      .def_property_readonly("missed", through(&R::report, &ControlledReport::missed),
                             "Above the tolerance at min_step.")
      .def("__repr__", [](const R& r) {
        return py::str("<ControlledReport: {:.6g} s, error {:.3g}>")
            .format(r.report.step, r.report.error);
      });
}

void bind_contact_force(py::module_& m) {
  using C = ContactPart;
  py::class_<C>(m, "ContactForce", "One contact as the inverse saw it.")
      .def_property_readonly(
          "geometry_a", [](const C& c) { return c.geometry(c.contact.contact.geometry_a); },
          "Name of the geometry of lower index.")
      .def_property_readonly(
          "geometry_b", [](const C& c) { return c.geometry(c.contact.contact.geometry_b); },
          "Name of the other one, on which the force acts.")
      .def_property_readonly(
          "position", [](const C& c) { return copy(VectorX(c.contact.contact.position)); },
          "Halfway between the surfaces, in the world [m], shape (3,).")
      .def_property_readonly(
          "normal", [](const C& c) { return copy(VectorX(c.contact.contact.normal)); },
          "Unit, from A to B, shape (3,).")
      .def_property_readonly(
          "frame",
          [](const C& c) {
            const Matrix3 axes = frame_from_normal(c.contact.contact.normal);
            return copy((Matrix3() << axes.col(2), axes.col(0), axes.col(1)).finished());
          },
          "Axes of the contact in the world as columns: normal, t1, t2, shape (3, 3); force @ "
          "frame "
          "is the force along them.")
      .def_property_readonly(
          "gap", [](const C& c) { return c.contact.contact.gap; },
          "Along the normal [m]; negative: overlap.")
      .def_property_readonly("force", through(&C::contact, &ContactForce::force),
                             "Mean over the step, on geometry B, in the world [N], shape (3,).")
      .def_property_readonly(
          "slip", through(&C::contact, &ContactForce::slip),
          "Velocity of B over A at the end of the step, across the normal, in the world [m/s], "
          "shape (3,).")
      .def("__repr__", [](const C& c) {
        return py::str("<ContactForce {} - {}: {} N>")
            .format(c.geometry(c.contact.contact.geometry_a),
                    c.geometry(c.contact.contact.geometry_b), copy(VectorX(c.contact.force)));
      });
}

// Long: declarations of the members of a class.
void bind_inverse(py::module_& m) {
  using I = InverseHandle;
  using Self = std::shared_ptr<I>;
  const auto all = [](const Self& i, const VectorX& x) { return view(x, py::cast(i), true); };
  py::class_<I, Self>(m, "Inverse", "What was at work between (q, v) and v_next.")
      .def_property_readonly(
          "applied_force", [all](const Self& i) { return all(i, i->inverse.applied_force); },
          "u [N, N m], shape (nv,).")
      .def_property_readonly(
          "contact_force", [all](const Self& i) { return all(i, i->inverse.contact_force); },
          "J' f / h of all constraints [N, N m], shape (nv,).")
      .def_property_readonly(
          "tendon_force", [all](const Self& i) { return all(i, i->inverse.tendon_force); },
          "Force along each tendon [N], mean over the step; a part of contact_force.")
      .def_property_readonly(
          "actuator_force", [all](const Self& i) { return all(i, i->inverse.actuator_force); },
          "Force of each actuator [N, N m], mean over the step, in the order of model.actuators.")
      .def_property_readonly(
          "z_next", [all](const Self& i) { return all(i, i->inverse.z_next); },
          "Internal states at the end of the step, shape (nz,).")
      .def_property_readonly(
          "servo_force", [all](const Self& i) { return all(i, i->inverse.servo_force); },
          "What the servos asked for at v_next [N, N m], in the order of model.servos.")
      .def_property_readonly("force_scale", through(&I::inverse, &Inverse::force_scale),
                             "Largest force at work [N or N m].")
      .def_property_readonly(
          "contacts",
          [](const I& i) {
            std::vector<ContactPart> out;
            for (const ContactForce& c : i.inverse.contacts) out.push_back({i.model, c});
            return out;
          },
          "List of ContactForce.")
      .def_property_readonly(
          "contact_forces",
          [](const Self& i) {
            const auto& c = i->inverse.contacts;
            static_assert(sizeof(ContactForce) % sizeof(double) == 0);
            constexpr py::ssize_t kStride = sizeof(ContactForce) / sizeof(double);
            return view(c.empty() ? nullptr : c.front().force.data(),
                        {static_cast<py::ssize_t>(c.size()), 3}, {kStride, 1}, py::cast(i));
          },
          "Forces of all contacts, on geometry B, in the world [N], shape (n, 3), read-only.")
      .def_property_readonly(
          "joint_forces",
          [](const I& i) {
            std::vector<std::tuple<const char*, int, double>> out;
            for (const JointForce& j : i.inverse.joints)
              out.emplace_back(effect_name(j.effect), j.v_index, j.force);
            return out;
          },
          "List of (effect, index in v, mean force over the step [N, N m]): of limits, velocity "
          "limits, dry friction and mimic joints (there on the follower).")
      .def_property_readonly(
          "closure_forces",
          [](const I& i) {
            py::array_t<double> out(
                {static_cast<py::ssize_t>(i.inverse.closures.size()), py::ssize_t{6}});
            double* row = out.mutable_data();
            for (const ClosureForce& c : i.inverse.closures) {
              row = std::copy_n(c.force.torque.data(), 3, row);
              row = std::copy_n(c.force.force.data(), 3, row);
            }
            return out;
          },
          "Of model.closures, on body B, in the world: torque [N m], force [N], shape (n, 6).")
      .def_property_readonly(
          "fault", [](const I& i) { return fault_of(i.model, i.inverse.fault); },
          "What is wrong with what was given, or None; forces are NaN then.")
      .def("__repr__", [](const I& i) {
        return py::str("<Inverse: {} contacts, largest force {:.6g}>")
            .format(i.inverse.contacts.size(), i.inverse.force_scale);
      });
}

}  // namespace

std::string message_of(const ReportHandle& r) {
  return r.report.succeeded() ? std::string() : apps::why_failed(r.model->model, r.report);
}

void check(const ReportHandle& r, const py::object& partial) {
  if (!r.report.succeeded()) throw_step_error(message_of(r), py::cast(r), partial);
}

void bind_reports(py::module_& m) {
  bind_fault(m);
  bind_step_report(m);
  bind_controlled_report(m);
  bind_contact_force(m);
  bind_inverse(m);
}

}  // namespace counterpoint::python
