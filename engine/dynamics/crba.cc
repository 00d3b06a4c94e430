#include "counterpoint/engine/dynamics/crba.h"

#include <cstddef>

#include "counterpoint/engine/dynamics/joint_motion.h"

namespace counterpoint {

namespace {

/// Writes both triangles of a symmetric matrix through a raw pointer, in a few instructions per
/// entry.
class SymmetricOut {
 public:
  explicit SymmetricOut(InertiaOut& M) : data_(M.data()), stride_(M.outerStride()) {}
  void set(std::ptrdiff_t i, std::ptrdiff_t j, double value) {
    data_[i * stride_ + j] = value;
    data_[j * stride_ + i] = value;
  }

 private:
  double* data_;
  std::ptrdiff_t stride_;
};

/// Writes the entries of coordinate j of a joint with coordinates 0 ... j of the same joint.
void set_own_force(const Body& body, const Motion* axis, const Force& f, int j, int first,
                   SymmetricOut& out) {
  if (body.joint_type == JointType::kRevolute)
    return out.set(first, first, axis->angular.dot(f.torque));
  const int linear = joint_num_linear(body.joint_type);
  for (int k = 0; k <= j; ++k)
    out.set(first + j, first + k,
            k < linear ? axis[k].linear.dot(f.force) : axis[k].angular.dot(f.torque));
}

/// Writes the entries of row `row` with the coordinates of an ancestor joint: S' f.
void set_joint_force(const Body& body, const Motion* axis, const Force& f, int row, int column,
                     SymmetricOut& out) {
  if (body.joint_type == JointType::kRevolute) {
    out.set(row, column, axis->angular.dot(f.torque));
    return;
  }
  const int nv = joint_nv(body.joint_type), linear = joint_num_linear(body.joint_type);
  for (int j = 0; j < linear; ++j) out.set(row, column + j, axis[j].linear.dot(f.force));
  for (int j = linear; j < nv; ++j) out.set(row, column + j, axis[j].angular.dot(f.torque));
}

/// Writes the rows of one body: the force that accelerates its subtree along each coordinate of its
/// joint, transported to the root. The force stays in registers; keeping the forces of all
/// coordinates of a subtree in memory (and processing four at a time) was not faster.
void fill_rows(const Model& model, const Tree& tree, const BodyState& bodies, int i,
               SymmetricOut& out) {
  const Kinematics& at = bodies.at;
  const Body& body = model.body(i);
  const Motion* axis = &at.axis[body.v_index];
  const RigidInertia& inertia = bodies.scratch.composite[i];
  const int first = body.v_index - tree.v_begin;
  for (int j = 0; j < joint_nv(body.joint_type); ++j) {
    Force f;
    if (body.joint_type == JointType::kRevolute) {
      f = {inertia.rotational * axis->angular, axis->angular.cross(inertia.moment)};
    } else {
      f = inertia * axis[j];
    }
    set_own_force(body, axis, f, j, first, out);
    for (int k = i, parent = body.parent; parent != 0;) {
      f.torque += at.arm[k].cross(f.force);
      const Body& ancestor = model.body(parent);
      set_joint_force(ancestor, &at.axis[ancestor.v_index], f, first + j,
                      ancestor.v_index - tree.v_begin, out);
      k = parent;
      parent = ancestor.parent;
    }
  }
}

}  // namespace

void crba_tree(const Model& model, const Tree& tree, const BodyState& bodies, InertiaOut M) {
  std::vector<RigidInertia>& composite = bodies.scratch.composite;
  for (int i = tree.body_begin; i < tree.body_end; ++i)
    composite[i] = RigidInertia::about_origin(bodies.at.inertia[i]);
  for (const AddedInertia& more : bodies.external.added)
    if (more.body >= tree.body_begin && more.body < tree.body_end)
      composite[more.body] += RigidInertia::about_origin(more.inertia);
  SymmetricOut out(M);
  for (int i = tree.body_end - 1; i >= tree.body_begin; --i) {
    fill_rows(model, tree, bodies, i, out);
    const int parent = model.body(i).parent;
    if (parent == 0) continue;
    RigidInertia moved = composite[i];
    moved.move(bodies.at.arm[i]);
    composite[parent] += moved;
  }
}

void crba(const Model& model, const BodyState& bodies, InertiaOut M) {
  M.setZero();
  for (const Tree& tree : model.trees()) {
    const int n = tree.v_end - tree.v_begin;
    crba_tree(model, tree, bodies, M.block(tree.v_begin, tree.v_begin, n, n));
  }
}

}  // namespace counterpoint
