#include "support/small_scenes.h"

namespace counterpoint::test {
namespace {

Scene start_at_rest(std::string name, Model model) {
  Scene scene{std::move(name), std::move(model), {}, {}, {}};
  scene.q = scene.model.default_q();
  scene.v = VectorX::Zero(scene.model.nv());
  return scene;
}

Scene on_fixed_base(const RobotSpec& robot) {
  ModelBuilder builder(Vector3(0, 0, -9.81));
  builder.add_robot(robot, Base::kFixed, Pose());
  return start_at_rest(robot.name, builder.build());
}

}  // namespace

Scene box_on_plane(const BoxOnPlane& box) {
  RobotSpec robot;
  robot.name = "box";
  const Vector3 s = 4.0 * box.half.cwiseAbs2();
  const Vector3 moments = box.mass / 12.0 * Vector3(s.y() + s.z(), s.x() + s.z(), s.x() + s.y());
  Material material;
  material.friction = box.friction;
  material.restitution = box.restitution;
  Shape shape;
  shape.type = ShapeType::kBox;
  shape.size = box.half;
  LinkSpec link;
  link.name = "box";
  link.inertia = {box.mass, Vector3::Zero(), moments.asDiagonal()};
  link.collisions.push_back({"", Pose(), shape, material});
  robot.links.push_back(link);

  ModelBuilder builder(box.gravity);
  Pose X_WL;
  X_WL.translation.z() = box.half.z() + box.height;
  builder.add_robot(robot, Base::kFloating, X_WL);
  Shape plane;
  plane.type = ShapeType::kPlane;
  if (box.ground) builder.add_environment("ground", plane, Pose(), material);
  return start_at_rest("box on plane", builder.build());
}

Scene pendulum(const Pendulum& parameters) {
  RobotSpec robot;
  robot.name = "pendulum";
  LinkSpec base, bob;
  base.name = "base";
  bob.name = "bob";
  bob.drag = parameters.drag;
  bob.gravity_compensation = parameters.gravity_compensation;
  bob.inertia = {parameters.mass, Vector3(0, 0, -parameters.length), Matrix3::Zero()};
  robot.links = {base, bob};
  JointSpec joint;
  joint.name = "swing";
  joint.parent = "base";
  joint.child = "bob";
  joint.axis = Vector3::UnitY();
  joint.damping = parameters.damping;
  joint.armature = parameters.armature;
  joint.dry_friction = parameters.dry_friction;
  joint.lower = parameters.lower;
  joint.upper = parameters.upper;
  robot.joints.push_back(joint);
  return on_fixed_base(robot);
}

Scene slider(const Slider& parameters) {
  RobotSpec robot;
  robot.name = "slider";
  LinkSpec base, block;
  base.name = "base";
  block.name = "block";
  block.inertia = {parameters.mass, Vector3::Zero(), Matrix3::Identity()};
  robot.links = {base, block};
  JointSpec joint;
  joint.name = "slide";
  joint.type = JointType::kPrismatic;
  joint.parent = "base";
  joint.child = "block";
  joint.axis = Vector3::UnitX();
  joint.dry_friction = parameters.dry_friction;
  joint.breakaway_friction = parameters.breakaway_friction;
  joint.stribeck_speed = parameters.stribeck_speed;
  joint.damping = parameters.damping;
  joint.stiffness = parameters.stiffness;
  joint.reference = parameters.reference;
  joint.servo = parameters.servo;
  joint.effort_limit = parameters.effort_limit;
  joint.velocity_limit = parameters.velocity_limit;
  joint.upper = parameters.upper;
  robot.joints.push_back(joint);
  return on_fixed_base(robot);
}

Scene ball_on_plane(const BallOnPlane& ball) {
  RobotSpec robot;
  robot.name = "ball";
  const Shape shape{ShapeType::kSphere, {ball.radius, 0, 0}, nullptr};
  LinkSpec link;
  link.name = "ball";
  link.inertia = {ball.mass, Vector3::Zero(),
                  0.4 * ball.mass * ball.radius * ball.radius * Matrix3::Identity()};
  link.collisions.push_back({"", Pose(), shape, ball.material});
  link.gravity_compensation = ball.gravity_compensation;
  robot.links.push_back(link);
  ModelBuilder builder(Vector3(0, 0, -9.81));
  Pose X_WL;
  X_WL.translation.z() = ball.radius + ball.height;
  builder.add_robot(robot, Base::kFloating, X_WL);
  builder.add_environment("ground", {ShapeType::kPlane, {}, nullptr}, Pose(), ball.material);
  return start_at_rest("ball on plane", builder.build());
}

Scene free_ball(const FreeBall& ball) {
  constexpr double kRadius = 0.1;
  RobotSpec robot;
  robot.name = "ball";
  LinkSpec link;
  link.name = "ball";
  link.inertia = {ball.mass, Vector3::Zero(),
                  0.4 * ball.mass * kRadius * kRadius * Matrix3::Identity()};
  link.drag = ball.drag;
  link.gravity_compensation = ball.gravity_compensation;
  robot.links.push_back(link);
  ModelBuilder builder(ball.gravity);
  builder.add_robot(robot, Base::kFloating, Pose());
  return start_at_rest("free ball", builder.build());
}

}  // namespace counterpoint::test
