#include "counterpoint/engine/crba.h"

#include "counterpoint/engine/joint_motion.h"
#include "counterpoint/engine/kinematics.h"

namespace counterpoint {

void crba_tree(const Model& model, const Tree& tree, Data& data, InertiaOut M) {
  for (int i = tree.body_begin; i < tree.body_end; ++i)
    data.composite[i] = ArticulatedInertia::rigid(data.inertia[i]);
  for (const AddedInertia& more : data.added)
    if (more.body >= tree.body_begin && more.body < tree.body_end)
      data.composite[more.body] += more.inertia;
  M.setZero();
  for (int i = tree.body_end - 1; i >= tree.body_begin; --i) {
    const Body& body = model.body(i);
    if (body.parent != 0) data.composite[body.parent] += data.composite[i].shifted(data.arm[i]);
    const int row = body.v_index - tree.v_begin;
    for (int j = 0; j < joint_nv(body.joint_type); ++j) {
      Force f = data.composite[i] * data.axis[body.v_index + j];
      add_joint_force(body.joint_type, &data.axis[body.v_index], f, &M(row + j, row));
      // The force that accelerates the subtree, carried to the root.
      for (int k = i; model.body(k).parent != 0;) {
        f = shift(f, data.arm[k]);
        k = model.body(k).parent;
        const Body& ancestor = model.body(k);
        add_joint_force(ancestor.joint_type, &data.axis[ancestor.v_index], f,
                        &M(row + j, ancestor.v_index - tree.v_begin));
      }
    }
  }
  // Off the diagonal the lower triangle is computed; joints of several coordinates computed both.
  for (int i = 0; i < M.rows(); ++i)
    for (int j = 0; j < i; ++j) M(j, i) = M(i, j);
}

void crba(const Model& model, Data& data, InertiaOut M) {
  M.setZero();
  for (const Tree& tree : model.trees()) {
    const int n = tree.v_end - tree.v_begin;
    crba_tree(model, tree, data, M.block(tree.v_begin, tree.v_begin, n, n));
  }
}

}  // namespace counterpoint
