#include "counterpoint/model/mjcf/bodies/contacts.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <set>

#include "counterpoint/model/mjcf/bodies/contact_springs.h"

namespace counterpoint::mjcf {
namespace {

using Pair = std::pair<int, int>;
Pair ordered(int a, int b) { return std::minmax(a, b); }

class ContactReader {
 public:
  ContactReader(Document& document, const Defaults& defaults, Assets& assets, const Bodies& bodies,
                const Switches& switches, MjcfModel& model)
      : document_(document),
        defaults_(defaults),
        assets_(assets),
        bodies_(bodies),
        switches_(switches),
        model_(model),
        springs_(bodies, switches, model),
        own_(bodies.geoms.size()) {}

  void read() {
    document_.each(document_.section_children("contact"), [&](const Element& e) {
      const std::string kind = e.Name();
      if (kind == "exclude")
        read_exclusion(e);
      else if (kind == "pair")
        read_pair(defaults_.values(e, ""));
      else
        document_.fail(e, "<pair> or <exclude> is expected");
    });
    std::vector<int> active;
    std::vector<std::string> meshes;
    for (int i = 0; i < static_cast<int>(bodies_.geoms.size()); ++i) {
      const Geom& geom = bodies_.geoms[i];
      if (geom.contype == 0 && geom.conaffinity == 0 && in_pair_.count(i) == 0) continue;
      active.push_back(i);
      if (geom.type == "mesh") meshes.push_back(geom.mesh);
    }
    assets_.load_ahead(meshes);
    for (const int i : active) {
      own_[i] = own_surface(i);
      document_.faults.collect([&] { add_shape(bodies_.geoms[i], own_[i]); });
    }
    for (std::size_t a = 0; a < active.size(); ++a)
      for (std::size_t b = a + 1; b < active.size(); ++b) join(active[a], active[b]);
    note_springs();
  }

 private:
  void read_exclusion(const Element& e) {
    document_.expect(e, {"name", "class", "body1", "body2"});
    const Values v(document_, e);
    excluded_.insert(ordered(bodies_.body(document_, e, v.text("body1")),
                             bodies_.body(document_, e, v.text("body2"))));
  }

  int geom_named(const Values& v, const char* key) const {
    const auto found = bodies_.geom_names.find(v.text(key));
    if (found != bodies_.geom_names.end()) return found->second;
    document_.fail(v.element(), fmt::format("{}: there is no geom '{}'", key, v.text(key)));
  }

  void read_pair(const Values& v) {
    const Element& e = v.element();
    document_.expect(e, {"name", "class", "geom1", "geom2", "condim", "friction", "solref",
                         "solimp", "solreffriction", "margin", "gap"});
    const int a = geom_named(v, "geom1"), b = geom_named(v, "geom2");
    const BodyNode &body_a = body_of(a), &body_b = body_of(b);
    if (body_a.weld == body_b.weld) return;  // one rigid body, without relative motion
    if (switches_.no_pairs) return;
    ContactParameters contact;
    contact.read(v);
    note_solref(e, contact);
    const std::vector<double> f = v.numbers("friction", 1, 5);
    if (!f.empty()) contact.slide = f[0];
    if (f.size() == 1 && f[0] != 1.0)
      document_.note(e,
                     "friction: one number is that of both directions; in MuJoCo the second is 1");
    if (f.size() > 2) contact.spin = f[2];
    if (f.size() > 3) contact.roll = f[3];
    Material surface = surface_of(a, b, contact);
    if (f.size() > 1 && contact.condim >= 3) set_sliding(e, a, b, f[0], f[1], surface);
    in_pair_.insert(a);
    in_pair_.insert(b);
    paired_[ordered(a, b)] = surface;
  }

  /// Sets the two coefficients of sliding. MuJoCo's first tangent at a plane that is fixed to the
  /// world is the projection of the world's y axis, or of z where the plane faces along y; at other
  /// shapes it follows their contact normal, and at capsules their axis.
  void set_sliding(const Element& e, int a, int b, double first, double second, Material& surface) {
    surface.friction = std::min(first, second);
    if (first == second) return;
    const auto is_ground = [&](int geom) {
      return bodies_.geoms[geom].type == "plane" && body_of(geom).weld == 0;
    };
    const int plane = is_ground(a) ? a : b, other = plane == a ? b : a;
    if (!is_ground(plane) || bodies_.geoms[other].type == "capsule")
      return document_.refuse(
          e, LeaveOut::kFrictionDirections,
          fmt::format("friction: the first two numbers differ, which is supported for a plane of "
                      "the world and a geom that is no capsule; give one value, or leave the "
                      "difference out: {} counts",
                      surface.friction));
    const Matrix3 R = (body_of(plane).X_WB * bodies_.geoms[plane].X_BG).rotation;
    surface.friction = first;
    surface.friction_across = second;
    surface.friction_axis =
        R.transpose() * (std::abs(R(1, 2)) < 0.5 ? Vector3::UnitY() : Vector3::UnitZ());
    surface.axis_of_second = plane > other;
  }

  const BodyNode& body_of(int geom) const { return bodies_.bodies[bodies_.geoms[geom].body]; }

  /// MuJoCo's filterparent: bodies that a joint connects do not collide, unless one of them is
  /// fixed to the world.
  bool are_joined(int a, int b) const {
    const int i = body_of(a).weld, j = body_of(b).weld;
    if (i == 0 || j == 0) return false;
    const auto above = [&](int body) { return bodies_.bodies[bodies_.bodies[body].parent].weld; };
    return above(i) == j || above(j) == i;
  }

  /// The geom with the higher priority; null if both have the same.
  const Geom* of_priority(int a, int b) const {
    const Geom &first = bodies_.geoms[a], &second = bodies_.geoms[b];
    if (first.priority == second.priority) return nullptr;
    return first.priority > second.priority ? &first : &second;
  }

  /// The surface of two geoms without a <pair>: that of the geom with the higher priority, else
  /// combined of both.
  Material combined_surface(int a, int b) {
    const Geom* one = of_priority(a, b);
    return surface_of(
        a, b, one ? one->contact : combined(bodies_.geoms[a].contact, bodies_.geoms[b].contact));
  }

  /// The surface of a geom against a body fixed to the world.
  Material own_surface(int i) {
    const Geom& geom = bodies_.geoms[i];
    note_solref(*geom.element, geom.contact);
    if (geom.contact.is_spring() && body_of(i).weld == 0)
      document_.note(*geom.element,
                     "solref is negative: bodies of other files find this surface hard, since the "
                     "stiffness depends on their masses");
    return springs_.between(geom.body, 0, geom.contact);
  }

  Material surface_of(int a, int b, const ContactParameters& contact) {
    const Material m = springs_.between(bodies_.geoms[a].body, bodies_.geoms[b].body, contact);
    if (contact.is_spring()) ++(m.is_soft() ? soft_pairs_ : hard_pairs_);
    return m;
  }

  void add_shape(const Geom& given, const Material& material) {
    const Geom geom = resolved(given, assets_, document_);
    const BodyNode& node = bodies_.bodies[geom.body];
    const Shape shape = shape_of(geom, assets_, document_);
    if (node.weld == 0) {
      model_.environment.push_back({geom.collision, shape, node.X_WB * geom.X_BG, material});
      return;
    }
    if (shape.type == ShapeType::kPlane || shape.type == ShapeType::kTerrain)
      document_.fail(*geom.element,
                     "it stands on a body that can move; planes and height fields are "
                     "fixed to the world");
    const std::string name = geom.collision.substr(node.link.size() + 1);
    model_.robot.links[node.link_index].collisions.push_back({name, geom.X_BG, shape, material});
  }

  void join(int a, int b) {
    const Geom &first = bodies_.geoms[a], &second = bodies_.geoms[b];
    if (body_of(a).weld == body_of(b).weld) return;  // one rigid body: never tested
    const auto pair = paired_.find(ordered(a, b));
    const bool match =
        (first.contype & second.conaffinity) != 0 || (second.contype & first.conaffinity) != 0;
    const bool off = switches_.constraint_off("contact");
    const bool touch = match && !switches_.pairs_only && !are_joined(a, b) &&
                       excluded_.count(ordered(first.body, second.body)) == 0;
    if (off || (pair == paired_.end() && !touch)) {
      const char* reason = off      ? "<flag> of the MJCF file: contact=\"disable\""
                           : !match ? "contype and conaffinity"
                           : switches_.pairs_only
                               ? "collision=\"predefined\": no <pair> of the MJCF file"
                           : are_joined(a, b) ? "of bodies joined by a joint"
                                              : "excluded by the MJCF file";
      model_.exclusions.push_back({first.collision, second.collision, reason});
      return;
    }
    if (pair != paired_.end()) model_.inclusions.emplace_back(first.collision, second.collision);
    const Material surface = pair == paired_.end() ? combined_surface(a, b) : pair->second;
    const Material usual = combine_materials(own_[a], own_[b]);
    if (same(surface, usual)) return;
    PairSurface values;
    values.friction = surface.friction;
    if (surface.is_directional()) {
      values.friction_axis = surface.friction_axis;
      values.friction_across = surface.friction_across;
    }
    if (surface.is_soft() || usual.is_soft()) {
      values.stiffness = surface.stiffness;
      values.damping = surface.damping;
    }
    values.torsional_friction = surface.torsional_friction;
    values.rolling_friction = surface.rolling_friction;
    const Geom &owner = surface.axis_of_second ? second : first,
               &other = surface.axis_of_second ? first : second;
    model_.surfaces.push_back({owner.collision, other.collision, values});
  }

  void note_solref(const Element& e, const ContactParameters& contact) {
    if (contact.is_spring() || contact.solref.minCoeff() > 0.0) return;
    document_.note(e,
                   "solref is not used: a stiffness needs a negative number, followed by a damping "
                   "that is negative or 0; MuJoCo takes its default if one of two is positive");
  }

  void note_springs() {
    if (switches_.constraint_off("contact")) return;
    const auto note = [&](int count, const char* what) {
      if (count == 0) return;
      document_.notes.push_back(
          {document_.file().string(),
           fmt::format("negative solref: pairs of geoms that {}: {}", what, count)});
    };
    note(soft_pairs_,
         "yield as in MuJoCo at rest, where they overlap by the width of solimp or more (impacts "
         "are shorter, since MuJoCo adds inertia to a contact)");
    note(hard_pairs_, "are hard, since the stiffness is 1e9 N/m or more");
  }

  static bool same(const Material& a, const Material& b) {
    constexpr double kRounding = 1e-12;  // relative round-off of the geometric mean
    const auto near = [](double x, double y) {
      return x == y || std::abs(x - y) <= kRounding * std::abs(y);
    };
    return !a.is_directional() && near(a.friction, b.friction) && near(a.stiffness, b.stiffness) &&
           near(a.damping, b.damping) && near(a.torsional_friction, b.torsional_friction) &&
           near(a.rolling_friction, b.rolling_friction);
  }

  Document& document_;
  const Defaults& defaults_;
  Assets& assets_;
  const Bodies& bodies_;
  const Switches& switches_;
  MjcfModel& model_;
  ContactSprings springs_;
  std::vector<Material> own_;            ///< per geom, against a body fixed to the world
  int soft_pairs_ = 0, hard_pairs_ = 0;  ///< pairs with a negative solref
  std::set<Pair> excluded_;              // indices of bodies
  std::set<int> in_pair_;
  std::map<Pair, Material> paired_;
};

}  // namespace

void read_contacts(Document& document, const Defaults& defaults, Assets& assets,
                   const Bodies& bodies, const Switches& switches, MjcfModel& model) {
  ContactReader(document, defaults, assets, bodies, switches, model).read();
}

}  // namespace counterpoint::mjcf
