// Derivatives of inverse dynamics (RNEA) and forward dynamics (ABA): what is computed of them.
#pragma once

#include "counterpoint/model/types.h"

namespace counterpoint {

/// Of tau = M(q) a - n(q, v), nv x nv each: by a displacement at q, by v, by a.
struct RneaDerivatives {
  MatrixX dq;  ///< [N, N m a m, rad]
  MatrixX dv;  ///< [N s/m, ...]
  MatrixX da;  ///< M(q), symmetric [kg, kg m, kg m^2]
};

/// Of a = inv(M(q) + D) (n(q, v) + tau), nv x nv each: by a displacement at q, by v, by tau.
struct AbaDerivatives {
  MatrixX dq, dv;
  MatrixX dtau;  ///< inv(M + D), symmetric
};

}  // namespace counterpoint
