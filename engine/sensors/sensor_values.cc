#include "counterpoint/engine/sensors/sensor_values.h"

#include <algorithm>

#include "counterpoint/collision/collider.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/model/special_values.h"

namespace counterpoint {
namespace {

/// Motion of a frame S in W, at its origin.
struct FrameState {
  Pose X_WS;
  Vector3 velocity = Vector3::Zero(), angular = Vector3::Zero();
};

struct Anchor {
  int body = 0;
  Pose X_BS;
};

/// The body and place of a frame that is fixed to a link (-1: the world).
Anchor anchor_of(const Model& model, int frame, const Pose& X_FS) {
  if (frame < 0) return {0, X_FS};
  const Frame& link = model.frames()[static_cast<std::size_t>(frame)];
  return {link.body, link.X_BF * X_FS};
}

FrameState frame_state(const SensedMotion& motion, int frame, const Pose& X_FS) {
  const Anchor anchor = anchor_of(motion.model, frame, X_FS);
  const auto b = static_cast<std::size_t>(anchor.body);
  const Pose& X_WB = motion.at.X_WB[b];
  const Motion& V = motion.at.V[b];
  return {X_WB * anchor.X_BS, V.at(X_WB.rotation * anchor.X_BS.translation), V.angular};
}

/// Acceleration of the origin of S and angular acceleration, in W; the linear one is that of the
/// point and not the spatial one.
Motion acceleration_of(const SensedMotion& motion, const Sensor& sensor) {
  const Anchor anchor = anchor_of(motion.model, sensor.frame, sensor.X_FS);
  const auto b = static_cast<std::size_t>(anchor.body);
  const Vector3 arm = motion.at.X_WB[b].rotation * anchor.X_BS.translation;
  const Motion& V = motion.at.V[b];
  const Motion& A = motion.A[b];
  return {A.angular, A.at(arm) + V.angular.cross(V.at(arm)) + motion.gravity};
}

void put(const Vector3& value, double* out) { std::copy_n(value.data(), 3, out); }

/// The orientation as the quaternion whose first component is not negative.
void put_orientation(const Matrix3& rotation, double* out) {
  Quaternion x(rotation);
  if (x.w() < 0.0) x.coeffs() = -x.coeffs();
  out[0] = x.w();
  std::copy_n(x.vec().data(), 3, out + 1);
}

/// Positions, orientations and velocities relative to the reference frame.
void relative_value(const SensedMotion& motion, const Sensor& sensor, SensorKind kind,
                    double* out) {
  const FrameState own = frame_state(motion, sensor.frame, sensor.X_FS);
  const FrameState reference = frame_state(motion, sensor.reference, Pose());
  const Pose& X_WR = reference.X_WS;
  const Matrix3 axes = (sensor.own_axes ? own.X_WS.rotation : X_WR.rotation).transpose();
  const Vector3 arm = own.X_WS.translation - X_WR.translation;
  switch (kind) {
    case SensorKind::kPosition:
      return put(X_WR.rotation.transpose() * arm, out);
    case SensorKind::kOrientation:
      return put_orientation(X_WR.rotation.transpose() * own.X_WS.rotation, out);
    case SensorKind::kLinearVelocity:
      return put(axes * (own.velocity - reference.velocity - reference.angular.cross(arm)), out);
    default:
      return put(axes * (own.angular - reference.angular), out);
  }
}

void acceleration_value(const SensedMotion& motion, const Sensor& sensor, SensorKind kind,
                        double* out) {
  const Motion own = acceleration_of(motion, sensor);
  Vector3 value = kind == SensorKind::kAngularAcceleration ? own.angular : own.linear;
  if (kind == SensorKind::kSpecificForce) value -= motion.gravity;
  if (sensor.own_axes)
    value = sensor_pose(motion.model, sensor, motion.at).rotation.transpose() * value;
  return put(value, out);
}

/// Whether an ascending list has a geometry; an empty one stands for all.
bool listed_or_all(const std::vector<int>& list, int geometry) {
  return list.empty() || std::binary_search(list.begin(), list.end(), geometry);
}

/// Calls count(contact, sign) for each contact between a sensor's geometries and others; the force
/// on the sensor's is sign times that of the contact.
template <class Count>
void for_each_contact(const SensedMotion& motion, const Sensor& sensor, const Count& count) {
  const auto has = [&](int geometry) {
    return std::binary_search(sensor.geometries.begin(), sensor.geometries.end(), geometry);
  };
  for (const ContactForce& one : motion.inverse.contacts) {
    const int other = has(one.contact.geometry_b) ? one.contact.geometry_a : one.contact.geometry_b;
    const double sign = sign_on(one, has);
    if (sign != 0.0 && listed_or_all(sensor.others, other)) count(one, sign);
  }
}

void contact_force_value(const SensedMotion& motion, const Sensor& sensor, double* out) {
  Vector3 sum = Vector3::Zero();
  for_each_contact(motion, sensor,
                   [&](const ContactForce& one, double sign) { sum += sign * one.force; });
  if (sensor.own_axes)
    sum = sensor_pose(motion.model, sensor, motion.at).rotation.transpose() * sum;
  return put(sum, out);
}

/// Sum of the normal forces of the contacts within the sensor's box.
double touch_value(const SensedMotion& motion, const Sensor& sensor) {
  const Pose X_SW = sensor_pose(motion.model, sensor, motion.at).inverse();
  double sum = 0.0;
  for_each_contact(motion, sensor, [&](const ContactForce& one, double) {
    const Vector3 place = X_SW * one.contact.position;
    if ((2.0 * place.array().abs() <= sensor.size.array()).all())
      sum += one.force.dot(one.contact.normal);
  });
  return sum;
}

void joint_value(const SensedMotion& motion, const Sensor& sensor, SensorKind kind, double* out) {
  const Body& body = motion.model.body(sensor.joint + 1);
  if (kind == SensorKind::kJointPosition) {
    std::copy_n(motion.q.data() + body.q_index, joint_nq(body.joint_type), out);
    return;
  }
  const bool effort = kind == SensorKind::kJointEffort;
  const double* values = effort ? motion.inverse.applied_force.data() : motion.v.data();
  std::copy_n(values + body.v_index, joint_nv(body.joint_type), out);
  const int servo = effort ? motion.model.find_servo(sensor.joint) : -1;
  if (servo >= 0) out[0] += motion.inverse.servo_force[servo];
}

/// Length of a tendon and its rate.
std::pair<double, double> tendon_motion(const SensedMotion& motion, int tendon) {
  return {motion.tendons.length(tendon), row_velocity(motion.tendons.arms(tendon), motion.v)};
}

double tendon_value(const SensedMotion& motion, int tendon, SensorKind kind) {
  if (kind == SensorKind::kTendonLength) return tendon_motion(motion, tendon).first;
  if (kind == SensorKind::kTendonVelocity) return tendon_motion(motion, tendon).second;
  return tendon_tension(motion.model, motion.inverse, tendon);
}

double actuator_value(const SensedMotion& motion, int actuator, SensorKind kind) {
  if (kind == SensorKind::kActuatorForce) return motion.inverse.actuator_force[actuator];
  const Actuator& a = motion.model.actuators()[static_cast<std::size_t>(actuator)];
  const bool rate = kind == SensorKind::kActuatorVelocity;
  if (a.tendon >= 0) {
    const auto [length, speed] = tendon_motion(motion, a.tendon);
    return a.gear * (rate ? speed : length);
  }
  const Body& body = motion.model.body(a.joint + 1);
  return a.gear * (rate ? motion.v[body.v_index] : motion.q[body.q_index]);
}

/// Sums of a part: mass [kg], first moment [kg m], momentum and angular momentum about the origin
/// of W.
struct Momenta {
  double mass = 0.0;
  Vector3 moment = Vector3::Zero(), linear = Vector3::Zero(), angular = Vector3::Zero();

  void add(const SpatialInertia& inertia, const Pose& X_WB, const Motion& V) {
    const Vector3 center = X_WB * inertia.center;
    const Vector3 momentum = inertia.mass * V.at(X_WB.rotation * inertia.center);
    const Vector3 spin =
        X_WB.rotation * (inertia.rotational * (X_WB.rotation.transpose() * V.angular));
    mass += inertia.mass;
    moment += inertia.mass * center;
    linear += momentum;
    angular += spin + center.cross(momentum);
  }
};

void subtree_value(const SensedMotion& motion, const CarriedPart& part, SensorKind kind,
                   double* out) {
  Momenta sum;
  const auto root = static_cast<std::size_t>(part.body);
  sum.add(part.share, motion.at.X_WB[root], motion.at.V[root]);
  for (const int child : part.children)
    for (int b = child; b < motion.model.body(child).subtree_end; ++b) {
      const auto i = static_cast<std::size_t>(b);
      sum.add(motion.model.body(b).inertia, motion.at.X_WB[i], motion.at.V[i]);
    }
  const Vector3 center = sum.moment / sum.mass;
  switch (kind) {
    case SensorKind::kCenterOfMass:
      return put(center, out);
    case SensorKind::kCenterOfMassVelocity:
      return put(sum.linear / sum.mass, out);
    case SensorKind::kLinearMomentum:
      return put(sum.linear, out);
    default:
      return put(sum.angular - center.cross(sum.linear), out);
  }
}

}  // namespace

PlacedSensor::PlacedSensor(const Model& model, int index)
    : sensor(&model.sensors()[static_cast<std::size_t>(index)]) {
  const auto needs_part = [](SensorKind k) { return senses_wrench(k) || senses_subtree(k); };
  if (std::any_of(sensor->kinds.begin(), sensor->kinds.end(), needs_part))
    part = carried_part(model, sensor->frame);
}

void sensed_value(const SensedMotion& motion, const PlacedSensor& placed, SensorKind kind,
                  double* out) {
  const Sensor& sensor = *placed.sensor;
  if (senses_joint(kind)) return joint_value(motion, sensor, kind, out);
  if (senses_subtree(kind)) return subtree_value(motion, placed.part, kind, out);
  if (kind == SensorKind::kContactForce) return contact_force_value(motion, sensor, out);
  if (kind == SensorKind::kTouch) return void(*out = touch_value(motion, sensor));
  if (kind == SensorKind::kPressure)
    return void(*out = touch_value(motion, sensor) / (sensor.size.x() * sensor.size.y()));
  if (senses_tendon(kind)) return void(*out = tendon_value(motion, sensor.tendon, kind));
  if (senses_actuator(kind)) return void(*out = actuator_value(motion, sensor.actuator, kind));
  if (takes_reference(kind)) return relative_value(motion, sensor, kind, out);
  return acceleration_value(motion, sensor, kind, out);
}

Pose sensor_pose(const Model& model, const Sensor& sensor, const Kinematics& at) {
  const Anchor anchor = anchor_of(model, sensor.frame, sensor.X_FS);
  return at.X_WB[static_cast<std::size_t>(anchor.body)] * anchor.X_BS;
}

double range_to(const Model& model, const Sensor& sensor, const Kinematics& at) {
  const Pose X_WS = sensor_pose(model, sensor, at);
  const int body = anchor_of(model, sensor.frame, Pose()).body;
  double nearest = kNaN;
  double limit = sensor.limit;
  for (const Geometry& geometry : model.geometries()) {
    const bool own_link = geometry.frame >= 0 && geometry.frame == sensor.frame;
    if (own_link || (body != 0 && geometry.body == body)) continue;
    const Pose X_WG = at.X_WB[static_cast<std::size_t>(geometry.body)] * geometry.X_BG;
    const auto hit =
        collision::cast_ray(geometry.shape, X_WG, X_WS.translation, X_WS.rotation.col(2), limit);
    if (!hit) continue;
    nearest = limit = hit->distance;
  }
  return nearest;
}

}  // namespace counterpoint
