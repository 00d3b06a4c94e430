#include "counterpoint/model/mjcf/bodies/reference_model.h"

#include <Eigen/Cholesky>

namespace counterpoint::mjcf {
namespace {

/// `heavier`: index of a link that gets `mass` more at its centre of mass, or -1.
Model bare_model(const MjcfModel& file, int heavier, double mass) {
  ModelBuilder builder;
  RobotSpec bare = file.robot;
  for (LinkSpec& link : bare.links) link.collisions.clear();
  for (JointSpec& joint : bare.joints) joint.mimic_master.clear();
  if (heavier >= 0) bare.links[heavier].inertia.mass += mass;
  builder.add_robot(bare, Base::kFixed, Pose());
  for (const MjcfModel::Coordinate& c : file.coordinates)
    builder.set_default_position(
        c.joint, Eigen::Map<const VectorX>(c.reference.data(),
                                           static_cast<Eigen::Index>(c.reference.size())));
  return builder.build();
}

}  // namespace

Model reference_model(const MjcfModel& file) { return bare_model(file, -1, 0.0); }

double inverse_mass(const MjcfModel& file, const Model& model, int link) {
  const LinkSpec& spec = file.robot.links[link];
  const int tree = model.body(model.frames()[model.find_frame(spec.name)].body).tree;
  // A point of the mass m at the centre of mass, whose Jacobian is J, adds m J'J to M.
  const double m = spec.inertia.mass > 0.0 ? spec.inertia.mass : 1.0;
  const MatrixX mass = reference_mass_matrix(model, tree, model.default_q());
  const Model heavier = bare_model(file, link, m);
  const MatrixX added = reference_mass_matrix(heavier, tree, model.default_q()) - mass;
  return mass.llt().solve(added).trace() / (3.0 * m);
}

}  // namespace counterpoint::mjcf
