#include "counterpoint/engine/dynamics.h"

#include <fmt/format.h>

#include <optional>

#include "counterpoint/engine/derivatives/dynamics/aba_derivatives.h"
#include "counterpoint/engine/derivatives/dynamics/inertia_regressor.h"
#include "counterpoint/engine/dynamics/aba.h"
#include "counterpoint/engine/dynamics/crba.h"
#include "counterpoint/engine/dynamics/energy.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/dynamics/rnea.h"
#include "counterpoint/engine/forces/tendons.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint {
namespace {

[[noreturn]] void throw_unknown(const Model& model, const std::string& name) {
  const Frame* best = nullptr;
  int least = 0;
  for (const Frame& frame : model.frames()) {
    const int distance = edit_distance(name, frame.name);
    if (best && distance >= least) continue;
    best = &frame;
    least = distance;
  }
  std::string hint = "; the model has none";
  if (best) hint = fmt::format("; did you mean \"{}\"?", best->name);
  throw InputError(fmt::format("no link or frame is called \"{}\"{}", name, hint));
}

}  // namespace

int frame_index(const Model& model, const std::string& name) {
  const int index = model.find_frame(name);
  if (index < 0) throw_unknown(model, name);
  return index;
}

FrameMotion frame_motion(const Model& model, const State& state, const std::string& name) {
  Dynamics dynamics(model);
  dynamics.set_state(state.q, state.v);
  return dynamics.frame(name);
}

std::vector<FrameMotion> frame_motions(const Model& model, const State& state) {
  Dynamics dynamics(model);
  dynamics.set_state(state.q, state.v);
  std::vector<FrameMotion> out;
  out.reserve(model.frames().size());
  for (std::size_t i = 0; i < model.frames().size(); ++i)
    out.push_back(dynamics.frame(static_cast<int>(i)));
  return out;
}

struct Dynamics::Impl {
  explicit Impl(const Model& m) : model(&m), data(m), v(VectorX::Zero(m.nv())) {
    if (!m.tendons().empty()) tendons.emplace(m);
  }

  void set(const VectorRef& q, const VectorRef* velocity) {
    if (q.size() != model->nq() || (velocity && velocity->size() != model->nv()))
      throw InputError(
          fmt::format("state of {} coordinates{} for a model of {} and {}", q.size(),
                      velocity ? fmt::format(" and {} velocities", velocity->size()) : "",
                      model->nq(), model->nv()));
    if (velocity) {
      v = *velocity;
    } else {
      v.setZero();
    }
    compute_poses(*model, q, data);
    if (tendons) tendons->find(*model, q, data, {});
    has_velocities = has_inertias = false;
  }

  // Data with the quantities that a caller needs; poses are always valid.
  Data& with_velocities() {
    if (!has_velocities) compute_velocities(*model, v, data);
    has_velocities = true;
    return data;
  }
  Data& with_inertias() {
    if (!has_inertias) compute_inertias(*model, data);
    has_inertias = true;
    return data;
  }
  Data& with_both() {
    with_velocities();
    return with_inertias();
  }

  const Model* model;
  Data data;
  VectorX v, acceleration;
  bool has_velocities = false, has_inertias = false;
  std::optional<Tendons> tendons;  // if the model has some
  // Created at first use.
  std::optional<RneaDerivator> of_rnea;
  std::optional<AbaDerivator> of_aba;
  std::optional<InertiaRegressor> regressor;
};

Dynamics::Dynamics(const Model& model) : impl_(std::make_unique<Impl>(model)) {
  set_configuration(model.default_q());
}
Dynamics::~Dynamics() = default;
Dynamics::Dynamics(Dynamics&&) noexcept = default;
Dynamics& Dynamics::operator=(Dynamics&&) noexcept = default;

const Model& Dynamics::model() const { return *impl_->model; }

void Dynamics::set_state(const VectorRef& q, const VectorRef& v) { impl_->set(q, &v); }

void Dynamics::set_configuration(const VectorRef& q) { impl_->set(q, nullptr); }

FrameMotion Dynamics::frame(int index) const {
  const Frame& frame = model().frames()[index];
  const Pose& X_WB = impl_->data.X_WB[frame.body];
  const Motion& V = impl_->with_velocities().V[frame.body];
  return {X_WB * frame.X_BF, V.at(X_WB.rotation * frame.X_BF.translation), V.angular};
}

FrameMotion Dynamics::frame(const std::string& name) const {
  return frame(frame_index(model(), name));
}

Pose Dynamics::frame_pose(int index) const {
  const Frame& frame = model().frames()[index];
  return impl_->data.X_WB[frame.body] * frame.X_BF;
}

void Dynamics::frame_jacobian(int index, MatrixX& jacobian) const {
  const Model& m = model();
  const Kinematics& data = impl_->data;
  const Frame& frame = m.frames()[index];
  jacobian.setZero(6, m.nv());
  // The joints between the frame and the root move it; arm: from the body's origin to the frame's.
  Vector3 arm = data.X_WB[frame.body].rotation * frame.X_BF.translation;
  for (int b = frame.body; b > 0; b = m.body(b).parent) {
    const Body& body = m.body(b);
    for (int k = body.v_index; k < body.v_index + joint_nv(body.joint_type); ++k)
      jacobian.col(k) << data.axis[k].angular, data.axis[k].at(arm);
    arm += data.arm[b];
  }
}

Pose Dynamics::geometry_pose(int index) const {
  const Geometry& geometry = model().geometries()[index];
  return impl_->data.X_WB[geometry.body] * geometry.X_BG;
}

ClosureGap Dynamics::closure_opening(int index) const {
  return closure_gap(model().closures()[static_cast<std::size_t>(index)], impl_->data.X_WB);
}

double Dynamics::tendon_length(int index) const { return impl_->tendons->length(index); }

void Dynamics::tendon_arms(int index, VectorOut arms) const {
  arms.setZero();
  for (const RowTerm& arm : impl_->tendons->arms(index)) arms[arm.v_index] = arm.coefficient;
}

double Dynamics::total_mass() const { return counterpoint::total_mass(model()); }

Vector3 Dynamics::center_of_mass() const {
  const Model& m = model();
  Vector3 moment = Vector3::Zero();
  for (int b = 1; b < m.num_bodies(); ++b)
    moment += m.body(b).inertia.mass * (impl_->data.X_WB[b] * m.body(b).inertia.center);
  return moment / total_mass();
}

double Dynamics::kinetic_energy() const {
  return counterpoint::kinetic_energy(model(), impl_->v, impl_->with_both());
}

double Dynamics::potential_energy() const {
  return counterpoint::potential_energy(model(), impl_->data);
}

Force Dynamics::momentum() const { return total_momentum(model(), impl_->with_both()); }

void Dynamics::inverse_dynamics(const VectorRef& a, VectorOut tau) {
  rnea(model(), a, model().gravity(), impl_->with_velocities(), tau);
}

bool Dynamics::forward_dynamics(const VectorRef& tau, const VectorRef& diagonal, VectorOut a,
                                int* singular_body) {
  return aba(model(), tau, diagonal, model().gravity(), moving_bodies(model()), impl_->with_both(),
             a, singular_body);
}

void Dynamics::mass_matrix(Eigen::Ref<MatrixX> M) {
  // M is symmetric: row-major and column-major order are the same.
  using ByRows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  crba(model(), impl_->with_inertias(),
       Eigen::Map<ByRows, 0, Eigen::OuterStride<>>(M.data(), M.rows(), M.cols(),
                                                   Eigen::OuterStride<>(M.outerStride())));
}

void Dynamics::inverse_dynamics_derivatives(const VectorRef& a, RneaDerivatives& out) {
  if (!impl_->of_rnea) impl_->of_rnea.emplace(model());
  impl_->of_rnea->compute(model(), impl_->v, a, model().gravity(), impl_->with_inertias(), out);
}

bool Dynamics::forward_dynamics_derivatives(const VectorRef& tau, const VectorRef& diagonal,
                                            AbaDerivatives& out, int* singular_body) {
  if (singular_body) *singular_body = 0;
  impl_->acceleration.resize(model().nv());
  if (!forward_dynamics(tau, diagonal, impl_->acceleration, singular_body)) return false;
  if (!impl_->of_aba) impl_->of_aba.emplace(model());
  return impl_->of_aba->compute(model(), impl_->v, impl_->acceleration, diagonal, model().gravity(),
                                impl_->data, out);
}

void Dynamics::inertia_regressor(const VectorRef& a, MatrixX& Y) {
  if (!impl_->regressor) impl_->regressor.emplace(model());
  impl_->regressor->compute(model(), impl_->v, a, model().gravity(), impl_->data, Y);
}

}  // namespace counterpoint
