// Derivatives of many steps in parallel.
#include <pybind11/stl.h>

#include "objects/batch_handle.h"
#include "objects/derivative_method.h"

namespace counterpoint::python {
namespace {

using Blocks = py::array_t<double>;

/// Results for a batch of inverses; C++ writes the blocks column by column.
struct InverseBlocks {
  Blocks applied_force, dq, dv, dv_next;
  py::array_t<bool> by_differences;
};
struct ForwardBlocks {
  Blocks dv_dq, dv_dv, dv_du, dq_dq, dq_dv, dq_du;
};

/// Returns column-major blocks as (row, column) arrays without a copy.
py::array as_rows(const Blocks& blocks) { return py::array(blocks.attr("swapaxes")(1, 2)); }

/// Copies of a call's arguments, made before the GIL is released.
struct Steps {
  std::vector<State> starts, ends;
  std::vector<Input> known;
};

Steps steps_from(const BatchHandle& b, const py::object& states, const Array& v_next,
                 const std::vector<InputPtr>& known) {
  Steps out;
  out.starts = states_from(*b.model, states);
  const auto count = static_cast<Eigen::Index>(out.starts.size());
  const auto rows = matrix(v_next, count, b.model->model.nv(), "v_next");
  for (Eigen::Index i = 0; i < count; ++i) out.ends.push_back({0.0, {}, rows.row(i)});
  if (!known.empty() && known.size() != out.starts.size())
    throw py::value_error("known: expected none, or one a state");
  for (const InputPtr& input : known) {
    if (input->model != b.model) throw py::value_error("known: an input is of another model");
    out.known.push_back(input->value());
  }
  return out;
}

InverseBlocks inverse_blocks(py::ssize_t count, py::ssize_t nv) {
  const Shape1 square{count, nv, nv};
  return {Blocks({count, nv}), Blocks(square), Blocks(square), Blocks(square),
          py::array_t<bool>(count)};
}

static_assert(sizeof(bool) == 1);
InverseDerivativeBlocks pointers(InverseBlocks& d) {
  return {d.applied_force.mutable_data(), d.dq.mutable_data(), d.dv.mutable_data(),
          d.dv_next.mutable_data(), reinterpret_cast<char*>(d.by_differences.mutable_data())};
}

InverseBlocks inverse_of_steps(BatchHandle& b, const py::object& states, const Array& v_next,
                               const std::vector<InputPtr>& known, const std::string& method) {
  const DerivativeMethod how = method_from(method);
  const Guard::Lock lock(b.guard, kBatch);
  const Steps steps = steps_from(b, states, v_next, known);
  InverseBlocks out =
      inverse_blocks(static_cast<py::ssize_t>(steps.starts.size()), b.model->model.nv());
  const InverseDerivativeBlocks where = pointers(out);
  const py::gil_scoped_release release;
  b.batch.inverse_derivatives(steps.starts, steps.ends, steps.known, where, how);
  return out;
}

py::tuple forward_of_steps(BatchHandle& b, const py::object& states, const Array& v_next,
                           const std::vector<InputPtr>& known, const std::string& method) {
  const DerivativeMethod how = method_from(method);
  const Guard::Lock lock(b.guard, kBatch);
  const Steps steps = steps_from(b, states, v_next, known);
  const auto count = static_cast<py::ssize_t>(steps.starts.size());
  const py::ssize_t nv = b.model->model.nv();
  const Shape1 square{count, nv, nv};
  InverseBlocks of_inverse = inverse_blocks(count, nv);
  ForwardBlocks out{Blocks(square), Blocks(square), Blocks(square),
                    Blocks(square), Blocks(square), Blocks(square)};
  const InverseDerivativeBlocks where = pointers(of_inverse);
  const ForwardDerivativeBlocks where_forward{out.dv_dq.mutable_data(), out.dv_dv.mutable_data(),
                                              out.dv_du.mutable_data(), out.dq_dq.mutable_data(),
                                              out.dq_dv.mutable_data(), out.dq_du.mutable_data()};
  {
    const py::gil_scoped_release release;
    b.batch.forward_derivatives(steps.starts, steps.ends, steps.known, where, where_forward, how);
  }
  // Runge-Kutta steps have no inverse, so nothing was written.
  if (b.scene.options.integrator == Integrator::kRungeKutta4)
    return py::make_tuple(py::none(), out);
  return py::make_tuple(of_inverse, out);
}

constexpr const char* kBatchInverseDoc = R"(
step_inverse_derivatives of many steps at once, over all cores, to the same bits.

Parameters
----------
states : array_like, shape (n, nq + nv), or sequence of State
    Where each step starts.
v_next : array_like, shape (n, nv)
    Where it led to [m/s, rad/s].
known : sequence of Input
    Wrenches, servo targets, softening: one a state, or none.
method : {'analytic', 'central_differences', 'extrapolated'}

Returns
-------
InverseDerivativesBatch
    NaN where forces are not known.
)";

constexpr const char* kBatchForwardDoc = R"(
step_forward_derivatives of many steps at once, over all cores, to the same bits.

Parameters
----------
states : array_like, shape (n, nq + nv), or sequence of State
    Where each step starts.
v_next : array_like, shape (n, nv)
    Where it led to [m/s, rad/s].
known : sequence of Input
    What acted: one a state, or none.
method : {'analytic', 'central_differences', 'extrapolated'}

Returns
-------
inverse : InverseDerivativesBatch or None
    None for runge_kutta_4, which has no inverse.
forward : ForwardDerivativesBatch
    NaN where a step has none.
)";

}  // namespace

void bind_batch_derivatives(py::module_& m,
                            py::class_<BatchHandle, std::shared_ptr<BatchHandle>>& batch) {
  using I = InverseBlocks;
  py::class_<I>(m, "InverseDerivativesBatch",
                "InverseDerivatives of n steps, one behind the other.")
      .def_readonly("applied_force", &I::applied_force, "u [N, N m], shape (n, nv).")
      .def_property_readonly(
          "dq", [](const I& d) { return as_rows(d.dq); }, "Shape (n, nv, nv).")
      .def_property_readonly(
          "dv", [](const I& d) { return as_rows(d.dv); }, "Shape (n, nv, nv).")
      .def_property_readonly(
          "dv_next", [](const I& d) { return as_rows(d.dv_next); }, "Shape (n, nv, nv).")
      .def_readonly("by_differences", &I::by_differences,
                    "By step: something acts that has no closed form, shape (n,).")
      .def("__len__", [](const I& d) { return d.dq.shape(0); })
      .def("__repr__", [](const I& d) {
        return py::str("<InverseDerivativesBatch: {} steps, nv {}>")
            .format(d.dq.shape(0), d.dq.shape(1));
      });
  using F = ForwardBlocks;
  py::class_<F> forward_class(m, "ForwardDerivativesBatch",
                              "ForwardDerivatives of n steps, one behind the other.");
  const auto add = [&](const char* name, Blocks F::*member) {
    forward_class.def_property_readonly(
        name, [member](const F& d) { return as_rows(d.*member); }, "Shape (n, nv, nv).");
  };
  add("dv_dq", &F::dv_dq);
  add("dv_dv", &F::dv_dv);
  add("dv_du", &F::dv_du);
  add("dq_dq", &F::dq_dq);
  add("dq_dv", &F::dq_dv);
  add("dq_du", &F::dq_du);
  forward_class.def("__len__", [](const F& d) { return d.dv_dq.shape(0); })
      .def("__repr__", [](const F& d) {
        return py::str("<ForwardDerivativesBatch: {} steps, nv {}>")
            .format(d.dv_dq.shape(0), d.dv_dq.shape(1));
      });
  batch
      .def("inverse_derivatives", &inverse_of_steps, py::arg("states"), py::arg("v_next"),
           py::kw_only(), py::arg("known") = std::vector<InputPtr>(),
           py::arg("method") = "analytic", kBatchInverseDoc)
      .def("forward_derivatives", &forward_of_steps, py::arg("states"), py::arg("v_next"),
           py::kw_only(), py::arg("known") = std::vector<InputPtr>(),
           py::arg("method") = "analytic", kBatchForwardDoc);
}

}  // namespace counterpoint::python
