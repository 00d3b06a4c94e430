// Joint-space inertia by the composite-rigid-body algorithm (Featherstone 2008, table 6.2).
#pragma once

#include "counterpoint/engine/dynamics/data.h"

namespace counterpoint {

/// Writable view of a row-major matrix.
using InertiaOut =
    Eigen::Ref<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>;

/// Mass matrix M(q) of one tree, both triangles, without rotor inertia (armature); square of size
/// v_end - v_begin [kg m^2, kg m, kg]. M must be zero. Requires compute_poses and compute_inertias.
void crba_tree(const Model& model, const Tree& tree, const BodyState& bodies, InertiaOut M);

/// Mass matrix of the whole model, nv x nv, block diagonal by tree. Same requirements.
void crba(const Model& model, const BodyState& bodies, InertiaOut M);

}  // namespace counterpoint
