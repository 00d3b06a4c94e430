#include "counterpoint/engine/crba.h"

#include "counterpoint/engine/joint_motion.h"

namespace counterpoint {

void crba_tree(const Model& model, const Tree& tree, Data& data, InertiaOut M) {
  for (int i = tree.body_begin; i < tree.body_end; ++i)
    data.composite[i] = ArticulatedInertia::rigid(model.body(i).inertia);
  M.setZero();
  for (int i = tree.body_end - 1; i >= tree.body_begin; --i) {
    const Body& body = model.body(i);
    if (body.parent != 0)
      data.composite[body.parent] += data.composite[i].transformed(data.X_PB[i]);
    const Matrix3 R_JB =
        joint_axes_turn(body.joint_type) ? joint_rotation(body.X_PJ, data.X_PB[i]) : Matrix3();
    const int row = body.v_index - tree.v_begin;
    for (int j = 0; j < joint_nv(body.joint_type); ++j) {
      Force f = data.composite[i] * joint_axis(body.joint_type, R_JB, j);
      add_joint_force(body.joint_type, R_JB, f, &M(row + j, row));
      M(row + j, row + j) += model.armature()[body.v_index + j];
      // The force that accelerates the subtree, carried to the root.
      for (int k = i; model.body(k).parent != 0;) {
        f = data.X_PB[k] * f;
        k = model.body(k).parent;
        const Body& ancestor = model.body(k);
        const Matrix3 R = joint_axes_turn(ancestor.joint_type)
                              ? joint_rotation(ancestor.X_PJ, data.X_PB[k])
                              : Matrix3();
        add_joint_force(ancestor.joint_type, R, f, &M(row + j, ancestor.v_index - tree.v_begin));
      }
    }
  }
  M.triangularView<Eigen::StrictlyUpper>() = M.transpose();
}

void crba(const Model& model, Data& data, InertiaOut M) {
  M.setZero();
  for (const Tree& tree : model.trees()) {
    const int n = tree.v_end - tree.v_begin;
    crba_tree(model, tree, data, M.block(tree.v_begin, tree.v_begin, n, n));
  }
}

}  // namespace counterpoint
