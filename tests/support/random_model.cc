#include "support/random_model.h"

#include <cmath>
#include <limits>
#include <numbers>

namespace counterpoint::test {

std::uint64_t Random::bits() {
  // SplitMix64 (Steele, Lea, Flood 2014).
  state_ += 0x9e3779b97f4a7c15ULL;
  std::uint64_t z = state_;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

double Random::uniform(double low, double high) {
  return low + (high - low) * std::ldexp(static_cast<double>(bits() >> 11), -53);
}

int Random::integer(int low, int high) {
  return low + static_cast<int>(bits() % static_cast<std::uint64_t>(high - low + 1));
}

Vector3 Random::vector(double size) {
  const double x = uniform(-size, size);
  const double y = uniform(-size, size);
  const double z = uniform(-size, size);
  return {x, y, z};
}

Vector3 Random::unit_vector() {
  while (true) {
    const Vector3 v = vector(1.0);
    if (v.norm() > 0.1 && v.norm() < 1.0) return v.normalized();
  }
}

Quaternion Random::quaternion() {
  // Shoemake's method: uniform over rotations.
  const double u = uniform(0.0, 1.0);
  // Long double rounds to the same double with every library of elementary functions.
  const long double a = uniform(0.0, 2.0 * std::numbers::pi);
  const long double b = uniform(0.0, 2.0 * std::numbers::pi);
  const auto sine = [](long double x) { return static_cast<double>(std::sin(x)); };
  const auto cosine = [](long double x) { return static_cast<double>(std::cos(x)); };
  return {std::sqrt(1.0 - u) * sine(a), std::sqrt(1.0 - u) * cosine(a), std::sqrt(u) * sine(b),
          std::sqrt(u) * cosine(b)};
}

SpatialInertia random_inertia(Random& random) {
  SpatialInertia inertia;
  inertia.mass = random.uniform(0.2, 3.0);
  inertia.center = random.vector(0.2);
  Vector3 s2;
  for (int i = 0; i < 3; ++i) s2[i] = std::pow(random.uniform(0.05, 0.4), 2);
  const Vector3 moments = inertia.mass / 12.0 * (Vector3::Constant(s2.sum()) - s2);
  const Matrix3 r = random.quaternion().toRotationMatrix();
  inertia.rotational = r * moments.asDiagonal() * r.transpose();
  return inertia;
}

Pose random_pose(Random& random, double size) {
  const Vector3 p = random.vector(size);
  return {random.quaternion().toRotationMatrix(), p};
}

namespace {

JointType random_type(Random& random, bool single_axis_only) {
  const int n = random.integer(0, single_axis_only ? 5 : 9);
  if (n < 4) return JointType::kRevolute;
  if (n < 6) return JointType::kPrismatic;
  if (n < 7) return JointType::kPlanar;
  if (n < 9) return JointType::kSpherical;
  return JointType::kFloating;
}

/// Lets some joints with one coordinate follow an earlier one.
void add_mimics(Random& random, RobotSpec& robot) {
  std::vector<std::string> masters;
  for (JointSpec& joint : robot.joints) {
    if (joint.fixed || joint_nv(joint.type) != 1) continue;
    if (!masters.empty() && random.uniform(0.0, 1.0) < 0.5) {
      joint.mimic_master =
          masters[static_cast<size_t>(random.integer(0, static_cast<int>(masters.size()) - 1))];
      joint.mimic_multiplier = random.uniform(-2.0, 2.0);
      joint.mimic_offset = random.uniform(-0.3, 0.3);
      joint.servo = {};
    }
    masters.push_back(joint.name);
  }
}

/// Makes a closure of any type but a screw, a spring or a rope for some.
void vary(Random& random, ClosureSpec& closure) {
  closure.type = static_cast<ClosureType>(random.integer(0, 6));
  const auto positive = [&](double most) {
    return Vector3(random.uniform(0.0, most), random.uniform(0.0, most), random.uniform(0.0, most));
  };
  if (closure.type == ClosureType::kDistance) {
    closure.rope = random.integer(0, 1) == 1;
    if (random.integer(0, 1) == 1) return;
    closure.stiffness = Vector3::Constant(random.uniform(0.0, 2000.0));
    closure.damping = Vector3::Constant(random.uniform(0.0, 20.0));
    return;
  }
  if (closure.type >= ClosureType::kHinge) closure.axis = random.vector(1.0);
  if (random.integer(0, 2) == 0) closure.stiffness = positive(2000.0);
  if (random.integer(0, 2) == 0) closure.damping = positive(20.0);
  if (!holds_angles(closure.type)) return;
  if (random.integer(0, 2) == 0) closure.rotational_stiffness = positive(200.0);
  if (random.integer(0, 2) == 0) closure.rotational_damping = Vector3::Constant(2.0);
}

void add_closures(Random& random, int count, bool any, const std::vector<std::string>& links,
                  ModelBuilder& builder) {
  const auto pick = [&] {
    return links[static_cast<size_t>(random.integer(0, static_cast<int>(links.size()) - 1))];
  };
  for (int i = 0; i < count; ++i) {
    ClosureSpec closure;
    closure.type = static_cast<ClosureType>(random.integer(0, 2));
    if (any) vary(random, closure);
    closure.link_b = pick();
    closure.link_a = pick();
    if (closure.link_a == closure.link_b || random.uniform(0.0, 1.0) < 0.2)
      closure.link_a = "world";
    closure.anchor_a = random.vector(0.3);
    if (closure.type == ClosureType::kDistance) closure.anchor_b = random.vector(0.3);
    builder.add_closure(closure);
  }
}

/// Adds a path of up to four points with up to two pulleys, spheres or cylinders.
void add_path(Random& random, const std::vector<std::string>& links, TendonSpec& tendon) {
  using Kind = TendonSpec::Place::Kind;
  const auto last = static_cast<int>(links.size()) - 1;
  const int a = random.integer(0, last), b = random.integer(0, last);
  const std::string ends[] = {a == b ? "world" : links[static_cast<size_t>(a)],
                              links[static_cast<size_t>(b)], "world"};
  const auto place = [&](Kind kind) {
    TendonSpec::Place& p = tendon.path.emplace_back();
    p.kind = kind;
    p.link = ends[tendon.path.size() == 1 ? 0 : random.integer(0, 2)];
    p.X_LG = random_pose(random, 0.3);
    p.radius = random.uniform(0.05, 0.3);
    if (kind != Kind::kPoint && random.integer(0, 1) == 1)
      p.side = Vector3(1.5 * p.radius, random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2));
    p.divisor = random.integer(1, 3);
  };
  place(Kind::kPoint);
  const int points = random.integer(1, 3);
  for (int i = 0; i < points; ++i) {
    const int between = random.integer(0, 3);
    if (between == 1) place(Kind::kSphere);
    if (between == 2) place(Kind::kCylinder);
    if (between == 3) {
      place(Kind::kPulley);
      place(Kind::kPoint);
      tendon.path.back().link = ends[0];  // else both ends of the branch may be on one body
    }
    place(Kind::kPoint);
  }
  tendon.path.back().link = ends[1];
  if (tendon.path[1].kind == Kind::kPulley) tendon.path.insert(tendon.path.begin(), tendon.path[0]);
}

/// Adds tendons to a robot; joints of several coordinates take no fixed tendon.
void add_tendons(Random& random, const RandomModelOptions& options, const RobotSpec& robot,
                 const std::string& prefix, ModelBuilder& builder) {
  std::vector<std::string> links, joints;
  for (size_t k = 1; k < robot.links.size(); ++k) links.push_back(prefix + robot.links[k].name);
  for (const JointSpec& joint : robot.joints)
    if (!joint.fixed && joint_nv(joint.type) == 1) joints.push_back(prefix + joint.name);
  for (int i = 0; i < options.tendons; ++i) {
    TendonSpec tendon;
    tendon.name = prefix + "tendon" + std::to_string(i);
    if (i % 2 == 0 && !joints.empty()) {
      for (const std::string& joint : joints)
        if (random.integer(0, 1) == 1) tendon.joints.push_back({joint, random.uniform(-1.0, 1.0)});
      if (tendon.joints.empty()) tendon.joints.push_back({joints[0], 0.5});
    } else {
      add_path(random, links, tendon);
    }
    tendon.stiffness = random.uniform(0.0, 60.0);
    tendon.damping = random.uniform(0.0, 3.0);
    if (random.integer(0, 2) == 0) tendon.rest = std::pair(0.2, random.uniform(0.3, 0.8));
    if (random.integer(0, 1) == 0) {
      tendon.servo = {random.uniform(0.0, 40.0), random.uniform(0.1, 3.0)};
      tendon.servo.speed = random.uniform(-0.2, 0.2);
      tendon.servo_target = random.uniform(0.1, 1.0);
    }
    if (options.tendon_friction) {
      tendon.dry_friction = random.uniform(0.0, 2.0);
      tendon.servo.least = -random.uniform(0.0, 5.0);
      tendon.servo.most = random.uniform(0.0, 5.0);
    }
    if (options.tendon_limits) {
      tendon.lower = random.uniform(0.1, 0.5);
      tendon.upper = tendon.lower + random.uniform(0.1, 0.5);
    }
    builder.add_tendon(tendon);
  }
}

}  // namespace

RobotSpec make_random_robot(std::uint64_t seed, const RandomModelOptions& options) {
  Random random(seed);
  RobotSpec robot;
  robot.name = "random" + std::to_string(seed);
  for (int i = 0; i < options.links; ++i) {
    LinkSpec link;
    link.name = "link" + std::to_string(i);
    link.inertia = random_inertia(random);
    if (options.drag) {
      link.drag = {random.uniform(0.0, 2.0), random.uniform(0.0, 2.0), random.uniform(0.0, 0.1),
                   random.uniform(0.0, 0.1)};
    }
    if (options.compensations && random.uniform(0.0, 1.0) < 0.7)
      link.gravity_compensation = random.uniform(-0.5, 1.5);
    robot.links.push_back(link);
    if (i == 0) continue;
    JointSpec joint;
    joint.name = "joint" + std::to_string(i);
    // Mostly chains, with branches.
    const int parent = random.uniform(0.0, 1.0) < 0.6 ? i - 1 : random.integer(0, i - 1);
    joint.parent = "link" + std::to_string(parent);
    joint.child = link.name;
    joint.fixed = random.uniform(0.0, 1.0) < options.fixed_share;
    joint.type = random_type(random, options.single_axis_only);
    joint.X_PJ = random_pose(random, 0.5);
    joint.axis = random.unit_vector();
    if (options.damping) joint.damping = random.uniform(0.0, 2.0);
    if (options.armature) joint.armature = random.uniform(0.0, 0.1);
    if (options.limits) {
      joint.lower = -random.uniform(0.5, 2.0);
      joint.upper = random.uniform(0.5, 2.0);
    }
    if (options.dry_friction) joint.dry_friction = random.uniform(0.0, 1.0);
    const bool one_axis = !joint.fixed && joint_nv(joint.type) == 1;
    if (!one_axis) joint.upper = std::numeric_limits<double>::infinity();
    if (options.springs && one_axis) {
      joint.stiffness = random.uniform(0.0, 50.0);
      joint.reference = random.uniform(-1.0, 1.0);
    }
    if (options.servos && one_axis) {
      joint.servo.stiffness = random.uniform(0.0, 200.0);
      joint.servo.damping = random.uniform(0.0, 20.0);
      joint.servo.position = random.uniform(-1.0, 1.0);
      joint.servo.velocity = random.uniform(-1.0, 1.0);
    }
    if (options.effort_limits) joint.effort_limit = random.uniform(0.5, 50.0);
    robot.joints.push_back(joint);
  }
  if (options.mimics) add_mimics(random, robot);
  return robot;
}

namespace {

/// Sets what an actuator acts on; joints are never empty.
void set_random_transmission(Random& random, const std::vector<std::string>& joints,
                             const std::vector<std::string>& links, const std::string& tendon,
                             ActuatorSpec& spec) {
  Actuator& a = spec.actuator;
  const auto any = [&](const std::vector<std::string>& names) {
    return names[static_cast<size_t>(random.integer(0, static_cast<int>(names.size()) - 1))];
  };
  const int place = random.integer(0, 3);
  if (place == 0) {
    a.transmission = Transmission::kLink;
    spec.link = any(links);
    a.point = random.vector(0.2);
    a.direction = {random.vector(1.0), random.vector(1.0)};
  } else if (place == 1 && !tendon.empty()) {
    a.transmission = Transmission::kTendon;
    spec.tendon = tendon;
  } else {
    spec.joint = any(joints);
  }
  a.gear = random.uniform(-2.0, 2.0);
}

void set_random_law(Random& random, Actuator& a) {
  a.gain = random.uniform(-3.0, 3.0);
  a.bias = random.uniform(-1.0, 1.0);
  if (a.transmission == Transmission::kLink) return;
  a.law = static_cast<ActuatorLaw>(random.integer(0, 2));
  a.stiffness = random.uniform(0.0, 20.0);
  a.damping = random.uniform(0.0, 2.0);
  a.kp = random.uniform(0.0, 20.0);
  a.ki = random.uniform(0.0, 10.0);
  a.kd = random.uniform(0.0, 2.0);
  a.integral_limit = random.uniform(0.5, 2.0);
  a.torque_constant = random.uniform(0.1, 1.0);
  a.resistance = random.uniform(0.5, 2.0);
  a.inductance = random.integer(0, 1) * random.uniform(0.0, 0.01);
  a.current_limit = random.uniform(1.0, 5.0);
  if (random.integer(0, 1) == 0) return;
  a.least = -random.uniform(0.0, 5.0);
  a.most = random.uniform(0.0, 5.0);
}

/// Adds actuators to a robot whose tendon, if it is given, may carry some.
void add_actuators(Random& random, int count, const RobotSpec& robot, const std::string& prefix,
                   const std::string& tendon, ModelBuilder& builder) {
  std::vector<std::string> links, joints;
  for (size_t k = 1; k < robot.links.size(); ++k) links.push_back(prefix + robot.links[k].name);
  for (const JointSpec& joint : robot.joints)
    if (!joint.fixed && joint_nv(joint.type) == 1) joints.push_back(prefix + joint.name);
  if (joints.empty()) return;
  for (int i = 0; i < count; ++i) {
    ActuatorSpec spec;
    Actuator& a = spec.actuator;
    a.name = prefix + "actuator" + std::to_string(i);
    set_random_transmission(random, joints, links, tendon, spec);
    set_random_law(random, a);
    a.command = random.uniform(-1.0, 1.0);
    if (random.integer(0, 2) == 0) a.lag = random.uniform(0.001, 0.1);
    if (random.integer(0, 2) == 0) a.slew = random.uniform(1.0, 20.0);
    if (random.integer(0, 2) == 0) {
      a.delay_samples = random.integer(1, 5);
      a.delay = random.uniform(0.001, 0.03);
    }
    builder.add_actuator(spec);
  }
}

}  // namespace

Model make_random_model(std::uint64_t seed, const RandomModelOptions& options) {
  ModelBuilder builder;
  std::vector<std::string> links;
  for (int i = 0; i < options.robots; ++i) {
    const RobotSpec robot = make_random_robot(seed * 1000 + static_cast<std::uint64_t>(i), options);
    const Pose X_WL{Matrix3::Identity(), Vector3(10.0 * i, 0, 0)};
    const std::string prefix = options.robots == 1 ? "" : std::to_string(i) + "/";
    builder.add_robot(robot, options.base, X_WL, prefix);
    if (options.tendons > 0 && robot.links.size() > 1) {
      Random random(seed + 99);
      add_tendons(random, options, robot, prefix, builder);
    }
    if (options.actuators > 0 && robot.links.size() > 1) {
      Random random(seed + 55);
      add_actuators(random, options.actuators, robot, prefix,
                    options.tendons > 0 ? prefix + "tendon0" : "", builder);
    }
    // Skips the root, which may be fixed to the world.
    for (size_t k = 1; k < robot.links.size(); ++k) links.push_back(prefix + robot.links[k].name);
  }
  if (options.closures > 0) {
    Random random(seed + 77);
    add_closures(random, options.closures, options.any_closures, links, builder);
  }
  return builder.build();
}

Scene make_random_scene(std::uint64_t seed, const RandomModelOptions& options, Random& random) {
  Model model = make_random_model(seed, options);
  VectorX q = random_configuration(model, random.bits());
  VectorX v = random_vector(model.nv(), random.bits());
  return {"random", std::move(model), std::move(q), std::move(v), {}};
}

VectorX random_configuration(const Model& model, std::uint64_t seed) {
  Random random(seed);
  VectorX q(model.nq());
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    const int nq = joint_nq(body.joint_type);
    for (int k = 0; k < nq; ++k) q[body.q_index + k] = random.uniform(-1.0, 1.0);
    if (body.joint_type == JointType::kRevolute) q[body.q_index] *= std::numbers::pi;
    if (body.joint_type == JointType::kPlanar) q[body.q_index + 2] *= std::numbers::pi;
    if (body.joint_type == JointType::kSpherical || body.joint_type == JointType::kFloating) {
      const Quaternion r = random.quaternion();
      q.segment<4>(body.q_index + nq - 4) << r.w(), r.x(), r.y(), r.z();
    }
  }
  return q;
}

VectorX random_vector(int size, std::uint64_t seed, double scale) {
  Random random(seed);
  VectorX v(size);
  for (int i = 0; i < size; ++i) v[i] = random.uniform(-scale, scale);
  return v;
}

}  // namespace counterpoint::test
