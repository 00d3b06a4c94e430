// Per-body results of the recursive algorithms. Recomputable; fields grouped by what fills them.
#pragma once

#include <vector>

#include "counterpoint/engine/articulated_inertia.h"
#include "counterpoint/model/model.h"

namespace counterpoint {

/// The joint's share of an articulated-body sweep, for joints of more than one coordinate.
struct MultiDofFactor {
  Eigen::Matrix<double, 6, 6> U;       ///< IA S, first nv columns
  Eigen::Matrix<double, 6, 6> D_inv;   ///< inverse of S' IA S + diagonal, nv x nv
  Vector6 u;                           ///< tau - S' pA
};

struct Data {
  explicit Data(const Model& model);

  // compute_kinematics (kinematics.h)
  std::vector<Pose> X_PB;    ///< body in its parent
  std::vector<Pose> X_WB;    ///< body in the world
  std::vector<Motion> V;     ///< V_WB in body axes at the body origin
  std::vector<Motion> V_J;   ///< velocity across the joint, in body axes: S v
  std::vector<Motion> c;     ///< velocity product: dS/dt v + V x V_J, in body axes

  // rnea, aba: external wrenches, set by the caller, in body axes at the body origin
  std::vector<Force> external;
  bool has_external = false;

  // rnea
  std::vector<Motion> A;     ///< spatial acceleration less gravity, body axes
  std::vector<Force> F;      ///< force through the joint, body axes

  // aba
  std::vector<ArticulatedInertia> IA;
  std::vector<Force> pA;
  std::vector<Motion> U;     ///< one-coordinate joints: IA S (as a force, kept as two vectors)
  std::vector<double> D_inv, u;
  std::vector<MultiDofFactor> multi;  ///< by body; used where joint_nv > 1

  // crba
  std::vector<ArticulatedInertia> composite;
};

}  // namespace counterpoint
