#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <sdf/Physics.hh>
#include <sdf/World.hh>

#include "counterpoint/model/sdf/reader.h"
#include "counterpoint/model/sdf/trees.h"

namespace counterpoint::sdf_file {
namespace {

/// Friction coefficient of a slope of 84 degrees: nothing slides where both directions have more,
/// so that their difference is irrelevant.
constexpr double kNeverSlides = 10.0;

class WorldReader {
 public:
  WorldReader(const std::filesystem::path& file, const SdfOptions& options)
      : document_(file, options), shapes_(document_) {
    model_.where = file.string();
  }

  SdfModel read() {
    document_.faults.collect([&] { read_root(document_.root()); });
    if (!document_.faults.any()) join();
    judge_directions();
    document_.faults.throw_if_any();
    document_.note_passed();
    if (model_.trees.empty() && model_.environment.empty())
      model_.notes.push_back({model_.where, "there is nothing to move and nothing to touch"});
    model_.notes.insert(model_.notes.begin(), document_.notes.begin(), document_.notes.end());
    return std::move(model_);
  }

 private:
  /// A collision surface, with the geometry name that ModelBuilder gives.
  struct Surface {
    std::string name;
    std::string link;
    int model;  ///< number of the outermost model
    bool is_static;
    CollisionRead read;
    bool matters = false;  ///< its anisotropic friction is felt by a surface that it touches
    const Material& material() const { return read.collision.material; }
    bool differs() const { return read.along != read.across && !has_axis(); }
    bool has_axis() const { return material().is_directional(); }
  };

  void read_root(const sdf::Root& root) {
    if (root.WorldCount() > 0) return read_world(*root.WorldByIndex(0));
    if (root.Model() != nullptr) {
      model_.name = root.Model()->Name();
      shapes_.load_ahead({root.Model()});
      return read_model(*root.Model(), "");
    }
    throw InputError(fmt::format("{}: there is no <world> and no <model>", model_.where));
  }

  void read_world(const sdf::World& world) {
    const sdf::ElementPtr element = world.Element();
    document_.pass_over_all_but(element, {"model", "include", "frame", "gravity", "physics", "wind",
                                          "atmosphere", "magnetic_field", "spherical_coordinates"});
    for (const char* name : {"population", "joint"})
      if (const sdf::ElementPtr e = Document::child(element, name))
        document_.fail(e, "this is not supported in a <world>");
    if (const sdf::ElementPtr state = Document::child(element, "state"))
      document_.note(state, "models start where their <pose> says, not as in this saved state");
    model_.name = world.Name();
    model_.gravity = to_vector(world.Gravity());
    if (const sdf::Physics* physics = world.PhysicsDefault()) {
      model_.time_step = physics->MaxStepSize();
      if (!(*model_.time_step > 0.0))
        document_.fail(element, "<max_step_size>: a positive number is expected");
    }
    windy_ = world.WindLinearVelocity() != ignition::math::Vector3d::Zero;
    std::vector<const sdf::Model*> models;
    for (std::uint64_t i = 0; i < world.ModelCount(); ++i) models.push_back(world.ModelByIndex(i));
    shapes_.load_ahead(models);
    for (const sdf::Model* model : models)
      document_.faults.collect([&] { read_model(*model, model->Name() + "/"); });
  }

  void read_model(const sdf::Model& model, const std::string& prefix) {
    ++models_;
    if (windy_ && model.EnableWind())
      document_.refuse(model.Element(), LeaveOut::kFluid, "<enable_wind>: wind is not supported");
    const Pose X_WT = document_.resolve(model.SemanticPose(), "", model.Element());
    const Bodies bodies = read_bodies(document_, shapes_, model, prefix);
    for (const LinkNode& link : bodies.fixed) {
      add_surfaces(link, true);
      for (const LinkSpec::Collision& c : link.spec.collisions)
        model_.environment.push_back(
            {link.spec.name + "/" + c.name, c.shape, X_WT * link.X_TL * c.X_LG, c.material});
    }
    for (const LinkNode& link : bodies.links) add_surfaces(link, false);
    if (bodies.links.empty() || document_.faults.any()) return;
    add_trees(document_, bodies, prefix, X_WT, model_);
    for (const SensorSpec& sensor : bodies.sensors) model_.sensors.push_back(sensor);
    for (const ActuatorSpec& motor : bodies.motors) add_motor(motor);
    exclude_within(bodies, model.Element());
  }

  /// Adds an actuator if its joint moves in a tree.
  void add_motor(const ActuatorSpec& motor) {
    for (const SdfModel::Tree& tree : model_.trees)
      for (const JointSpec& joint : tree.robot.joints)
        if (joint.name == motor.joint && !joint.fixed) return model_.commanded.push_back(motor);
    model_.notes.push_back(
        {motor.where, fmt::format("no joint '{}' moves in a tree; left out", motor.joint)});
  }

  void add_surfaces(const LinkNode& link, bool is_static) {
    for (std::size_t i = 0; i < link.spec.collisions.size(); ++i) {
      const LinkSpec::Collision& c = link.spec.collisions[i];
      surfaces_.push_back(
          {link.spec.name + "/" + c.name, link.spec.name, models_, is_static, link.collisions[i]});
    }
  }

  /// For each link the lowest index of all links that joints connect it to.
  static std::vector<int> connected(const Bodies& bodies) {
    std::vector<int> first(bodies.links.size());
    std::iota(first.begin(), first.end(), 0);
    for (const JointNode& joint : bodies.joints) {
      if (joint.parent < 0 || joint.child < 0) continue;
      const auto [low, high] = std::minmax(first[joint.parent], first[joint.child]);
      std::replace(first.begin(), first.end(), int(high), int(low));
    }
    return first;
  }

  /// Excludes pairs of links of one model unless one of them has self_collide, and all pairs that a
  /// joint connects.
  void exclude_within(const Bodies& bodies, const sdf::ElementPtr& model) {
    const std::vector<int> first_of = connected(bodies);
    bool noted = false;
    const auto touches = [&](int i) { return i >= 0 && !bodies.links[i].spec.collisions.empty(); };
    for (const JointNode& joint : bodies.joints)
      if (touches(joint.parent) && touches(joint.child))
        model_.exclusions.push_back({bodies.links[joint.parent].spec.name,
                                     bodies.links[joint.child].spec.name,
                                     "of links joined by a joint"});
    for (std::size_t a = 0; a < bodies.links.size(); ++a) {
      for (std::size_t b = a + 1; b < bodies.links.size(); ++b) {
        const LinkNode &first = bodies.links[a], &second = bodies.links[b];
        if (first.self_collide || second.self_collide || !touches(static_cast<int>(a)) ||
            !touches(static_cast<int>(b)))
          continue;
        model_.exclusions.push_back({first.spec.name, second.spec.name, "self_collide is off"});
        if (noted || first_of[a] == first_of[b]) continue;
        noted = true;
        document_.note(
            model, fmt::format(
                       "links that no joints connect, as '{}' and '{}', never touch, as in Gazebo: "
                       "<self_collide> is off",
                       first.spec.name, second.spec.name));
      }
    }
  }

  /// Excludes pairs without a common bit of collide_bitmask. The others get the smaller friction
  /// and restitution of both surfaces, as in Gazebo with ODE and with DART.
  void join() {
    for (std::size_t i = 0; i < surfaces_.size(); ++i) {
      for (std::size_t j = i + 1; j < surfaces_.size(); ++j) {
        Surface &a = surfaces_[i], &b = surfaces_[j];
        if ((a.is_static && b.is_static) || a.link == b.link) continue;
        if ((a.read.bitmask & b.read.bitmask) == 0) {
          model_.exclusions.push_back({a.name, b.name, "collide_bitmask"});
          continue;
        }
        const double along = std::min(a.read.along, b.read.along),
                     across = std::min(a.read.across, b.read.across);
        // ODE takes the axis of the smaller coefficient.
        const bool of_b = b.has_axis() && !(a.has_axis() && a.read.along <= b.read.along);
        const Surface &owner = of_b ? b : a, &other = of_b ? a : b;
        PairSurface values;
        values.friction = std::min(along, across);
        if (owner.has_axis() && along != across) {
          values.friction = along;
          values.friction_axis = owner.material().friction_axis;
          values.friction_across = across;
        } else if (a.model != b.model && along != across &&
                   std::min(along, across) < kNeverSlides) {
          (a.differs() ? a : b).matters = true;
        }
        if (!owner.has_axis() && same(a.material(), b.material())) continue;
        values.restitution = std::min(a.material().restitution, b.material().restitution);
        model_.surfaces.push_back({owner.name, other.name, values});
      }
    }
  }

  /// Refuses anisotropic friction where it would be felt: against a surface of this file, or on a
  /// movable model alone in its file, which a scene may place anywhere.
  void judge_directions() {
    for (const Surface& s : surfaces_) {
      if (!s.differs()) continue;
      const double less = s.material().friction;
      const std::string what = fmt::format(
          "mu = {} and mu2 = {} without <fdir1>, the direction of mu", s.read.along, s.read.across);
      if (s.matters || (!s.is_static && models_ == 1 && less < kNeverSlides))
        document_.refuse(
            s.read.element, LeaveOut::kFrictionDirections,
            fmt::format("{}; give one value, or leave the difference out: {} counts", what, less));
      else
        document_.note(s.read.element, fmt::format("{}; {} counts", what, less));
    }
  }

  static bool same(const Material& a, const Material& b) {
    return a.friction == b.friction && a.restitution == b.restitution;
  }

  Document document_;
  ShapeReader shapes_;
  SdfModel model_;
  std::vector<Surface> surfaces_;
  bool windy_ = false;
  int models_ = 0;
};

}  // namespace

SdfModel read_model(const std::filesystem::path& file, const SdfOptions& options) {
  return WorldReader(file, options).read();
}

}  // namespace counterpoint::sdf_file
