#include "counterpoint/engine/derivatives/dynamics/rnea_derivatives.h"

namespace counterpoint {

RneaDerivator::RneaDerivator(const Model& model)
    : sweep_(model), responds_(model.num_bodies(), 0), zero_(VectorX::Zero(model.nv())) {}

void RneaDerivator::compute(const Model& model, const VectorRef& v, const VectorRef& a,
                            const Vector3& gravity, const Data& data, RneaDerivatives& out) {
  const int nv = model.nv();
  const bool one = model.num_trees() == 1;
  for (MatrixX* m : {&out.dq, &out.dv, &out.da}) {
    if (m->rows() != nv || m->cols() != nv) m->resize(nv, nv);
    if (!one) m->setZero();
  }
  SweepInput in;
  in.v = data.has_coriolis ? v.data() : zero_.data();
  in.a = a.data();
  in.gravity = gravity;
  if (data.has_external) {
    if (responses_.empty()) responses_.resize(model.num_bodies());
    in.load = data.external.data();
    in.response = responses_.data();
    in.responds = responds_.data();
    in.v_next = zero_.data();
  }
  for (const Tree& tree : model.trees()) {
    for (int i = tree.body_begin; data.has_external && i < tree.body_end; ++i) {
      const Force& f = data.external[i];
      responds_[i] = !f.force.isZero(0.0) || !f.torque.isZero(0.0);
      if (!responds_[i]) continue;
      // The wrench keeps its world axes: the response cancels the change that the sweep adds for
      // forces carried along with the body.
      BodyResponse& response = responses_[i];
      response.q.setZero();
      response.q.topLeftCorner<3, 3>() = -skew(f.torque);
      response.q.bottomLeftCorner<3, 3>() = -skew(f.force);
      response.next.setZero();
      response.move(data.X_WB[i].translation - TreeSweep::reference(tree, data));
    }
    sweep_.run(model, tree, data, in, {out.dq, out.dv, out.da});
  }
}

}  // namespace counterpoint
