// Joint-space inertia by the composite-rigid-body algorithm (Featherstone 2008, table 6.2).
#pragma once

#include "counterpoint/engine/dynamics/data.h"

namespace counterpoint {

/// Row-major view of a matrix that somebody else owns.
using InertiaOut =
    Eigen::Ref<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>;

/// M(q) of the bodies of one tree, both triangles, without rotor inertia (armature): (v_end -
/// v_begin) squared [kg m^2, kg m, kg]. Needs compute_poses and compute_inertias.
void crba_tree(const Model& model, const Tree& tree, const BodyState& bodies, InertiaOut M);

/// The same of the whole model, nv x nv, block diagonal by tree.
void crba(const Model& model, const BodyState& bodies, InertiaOut M);

}  // namespace counterpoint
