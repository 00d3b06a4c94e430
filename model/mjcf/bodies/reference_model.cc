#include "counterpoint/model/mjcf/bodies/reference_model.h"

#include <Eigen/Cholesky>

namespace counterpoint::mjcf {
namespace {

Model with_inertia(Model model, int body, const SpatialInertia& inertia) {
  ModelEditor editor(std::move(model));
  editor.set_inertia(body, inertia);
  return editor.take();
}

}  // namespace

Model reference_model(const MjcfModel& model) {
  ModelBuilder builder;
  RobotSpec bare = model.robot;
  for (LinkSpec& link : bare.links) link.collisions.clear();
  for (JointSpec& joint : bare.joints) joint.mimic_master.clear();
  builder.add_robot(bare, Base::kFixed, Pose());
  for (const auto* list : {&model.coordinates, &model.mocaps})
    for (const MjcfModel::Coordinate& c : *list)
      builder.set_default_position(
          c.joint, Eigen::Map<const VectorX>(c.reference.data(),
                                             static_cast<Eigen::Index>(c.reference.size())));
  return builder.build();
}

double InverseMasses::of(const LinkSpec& link) {
  const Frame frame = model_.frames()[model_.find_frame(link.name)];
  const int tree = model_.body(frame.body).tree;
  TreeInertia& known = trees_[tree];
  if (known.mass.size() == 0) {
    known.mass = reference_mass_matrix(model_, tree, model_.default_q());
    known.inverse = known.mass.llt().solve(MatrixX::Identity(known.mass.rows(), known.mass.cols()));
  }
  // A point of the mass m at the centre of mass, whose Jacobian is J, adds m J'J to M.
  const SpatialInertia own = model_.body(frame.body).inertia;
  const SpatialInertia point{own.mass, frame.X_BF * link.inertia.center, Matrix3::Zero()};
  model_ = with_inertia(std::move(model_), frame.body, own + point);
  const MatrixX added = reference_mass_matrix(model_, tree, model_.default_q()) - known.mass;
  model_ = with_inertia(std::move(model_), frame.body, own);
  return known.inverse.cwiseProduct(added).sum() / (3.0 * point.mass);
}

}  // namespace counterpoint::mjcf
