// The only way to make a Model: links and joints in, validated flat arrays out.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "counterpoint/model/model.h"

namespace counterpoint {

/// One link of a robot or one free object, as a file describes it.
struct LinkSpec {
  std::string name;
  SpatialInertia inertia;  ///< in the link frame
  struct Collision {
    std::string name;      ///< empty: numbered
    Pose X_LG;
    Shape shape;
    Material material;
  };
  std::vector<Collision> collisions;
  std::string where;       ///< file and line, for messages
};

/// What joins two links, before merging: fixed joints exist here only.
struct JointSpec {
  std::string name;
  bool fixed = false;
  JointType type = JointType::kRevolute;
  std::string parent, child;   ///< link names
  Pose X_PJ;                   ///< joint frame in the parent link frame; the child link frame at q = 0
  Vector3 axis = Vector3::UnitX();  ///< unit, in the joint frame; rotation, translation, or plane normal
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  double effort_limit = std::numeric_limits<double>::infinity();
  double velocity_limit = std::numeric_limits<double>::infinity();
  double damping = 0.0, dry_friction = 0.0, armature = 0.0;
  std::string mimic_master;    ///< empty: none
  double mimic_multiplier = 1.0, mimic_offset = 0.0;
  std::string where;
};

/// A robot or object as read from one file, before it is placed in a scene.
struct RobotSpec {
  std::string name;
  std::vector<LinkSpec> links;
  std::vector<JointSpec> joints;   ///< form one tree
  std::vector<Note> notes;         ///< found while reading
  std::string where;
};

enum class Base { kFixed, kFloating };

class ModelBuilder {
 public:
  explicit ModelBuilder(const Vector3& gravity = Vector3(0, 0, -kStandardGravity));

  /// Adds a robot whose root link is welded to the world at X_WL or floats, starting there.
  /// `prefix` ("arm/" say, or empty) goes before every name. Returns the instance index.
  /// @throws InputError naming link or joint when the spec is no tree, a moving part has no inertia,
  /// a value is not finite, a name is taken.
  int add_robot(const RobotSpec& robot, Base base, const Pose& X_WL, const std::string& prefix = "");

  /// Adds geometry fixed to the world, such as the ground. Returns the geometry index.
  int add_environment(const std::string& name, const Shape& shape, const Pose& X_WG,
                      const Material& material);

  /// The coordinate of a joint in the default configuration (otherwise 0, moved to the nearest limit
  /// if 0 lies outside the limits; that is noted).
  void set_default_position(const std::string& joint, const VectorX& q);

  void exclude_pair(const std::string& geometry_or_link_a, const std::string& geometry_or_link_b);

  Model build();

 private:
  Model model_;
  int num_instances_ = 0;
};

}  // namespace counterpoint
