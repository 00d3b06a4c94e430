#include "counterpoint/engine/derivatives/dynamics/aba_derivatives.h"

namespace counterpoint {

bool AbaDerivator::compute(const Model& model, const VectorRef& v, const VectorRef& a,
                           const VectorRef& diagonal, const Vector3& gravity, const Data& data,
                           AbaDerivatives& out) {
  rnea_.compute(model, v, a, gravity, data, inverse_);
  const int nv = model.nv();
  inverse_.da.diagonal() += diagonal;
  solver_.begin_tree(inverse_.da, parents_, 0, 3 * nv);
  solver_.add(inverse_.dq, 0, -1.0);
  solver_.add(inverse_.dv, nv, -1.0);
  solver_.add_identity(2 * nv);
  if (!solver_.solve()) return false;
  for (MatrixX* m : {&out.dq, &out.dv, &out.dtau})
    if (m->rows() != nv || m->cols() != nv) m->resize(nv, nv);
  solver_.get(0, out.dq);
  solver_.get(nv, out.dv);
  solver_.get(2 * nv, out.dtau);
  return true;
}

}  // namespace counterpoint
