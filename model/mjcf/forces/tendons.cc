#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <cstring>
#include <set>

#include "counterpoint/model/builder/tendon_path.h"
#include "counterpoint/model/mjcf/forces/equality.h"

namespace counterpoint::mjcf {
namespace {

using Place = TendonSpec::Place;

/// Reads springs, dampers, friction and limits.
void read_forces(Document& document, const Values& v, double reference, TendonSpec& spec) {
  spec.stiffness = v.number("stiffness", 0.0);
  spec.damping = v.number("damping", 0.0);
  spec.dry_friction = v.number("frictionloss", 0.0);
  const std::vector<double> rest = v.numbers("springlength", 1, 2);
  spec.rest = rest.empty() || rest[0] < 0.0 ? std::pair(reference, reference)
                                            : std::pair(rest[0], rest.back());
  if (v.number("armature", 0.0) > 0.0)
    document.refuse(v.element(), LeaveOut::kTendons, "armature of a tendon is not supported");
  const std::string limited = v.word("limited", {"true", "false", "auto"}, "auto");
  const bool has_limits = limited == "auto"
                              ? document.compiler(v.element()).auto_limits && v.has("range")
                              : limited == "true";
  if (!has_limits) return;
  const std::vector<double> range = v.numbers("range", 2, 2);
  if (range.empty() || !(range[0] < range[1]))
    document.fail(v.element(), "range: two numbers are expected, the first less");
  spec.lower = range[0];
  spec.upper = range[1];
}

/// Adds the forces of a tendon to a joint; the length of the tendon is c q + constant.
void apply(const TendonSpec& f, double c, double constant, JointSpec& joint) {
  if (f.stiffness > 0.0) {
    const double stiffness = c * c * f.stiffness, rest = (f.rest->first - constant) / c;
    const double sum = joint.stiffness + stiffness;
    joint.reference = (joint.stiffness * joint.reference + stiffness * rest) / sum;
    joint.stiffness = sum;
  }
  joint.damping += c * c * f.damping;
  joint.dry_friction += std::abs(c) * f.dry_friction;
  double lower = (f.lower - constant) / c, upper = (f.upper - constant) / c;
  if (c < 0.0) std::swap(lower, upper);
  joint.lower = std::max(joint.lower, lower);
  joint.upper = std::min(joint.upper, upper);
}

void apply_one(Document& document, const Defaults& defaults, const TendonElement& tendon,
               const Couplings& couplings, MjcfModel& model) {
  TendonSpec spec = tendon.spec;
  read_forces(document, defaults.values(*tendon.element, "", "tendon"), tendon.reference, spec);
  const Couplings::Reduced length = couplings.reduce(tendon.sum);
  const bool slack = spec.stiffness > 0.0 && spec.rest->first != spec.rest->second;
  if (tendon.fixed && length.sum.size() == 1 && !slack) {
    const auto& [joint, c] = length.sum[0];
    return apply(spec, c, length.constant, model.robot.joints[joint]);
  }
  if (tendon.fixed && length.sum.empty()) return;  // its length is constant
  model.tendons.push_back(std::move(spec));
}

/// Reads the path of a spatial tendon.
class PathReader {
 public:
  PathReader(const Document& document, const Bodies& bodies, TendonElement& tendon)
      : document_(document), bodies_(bodies), tendon_(tendon) {}

  void read() {
    for (const Element* part : document_.children(*tendon_.element)) {
      Place place;
      const std::string kind = part->Name();
      if (kind == "site") {
        const Site& site = find_site(*part, "site");
        place.link = bodies_.bodies[site.body].link;
        place.X_LG = site.X_BS;
      } else if (kind == "geom") {
        read_wrap(*part, place);
      } else if (kind == "pulley") {
        place.kind = Place::Kind::kPulley;
        place.divisor = Values(document_, *part).number("divisor", 0.0);
      } else {
        document_.fail(*part, "a <site>, <geom> or <pulley> is expected");
      }
      tendon_.spec.path.push_back(place);
    }
    if (tendon_.spec.path.size() < 2)
      document_.fail(*tendon_.element, "a path of at least two sites is expected");
    Tendon at_reference;
    make_tendon_path(
        tendon_.spec,
        [&](const std::string& link) {
          const auto node = std::find_if(bodies_.bodies.begin(), bodies_.bodies.end(),
                                         [&](const BodyNode& b) { return b.link == link; });
          return std::pair(0, node->X_WB);
        },
        at_reference);
    const std::vector<Pose> world(1);
    for (const TendonSegment& segment : at_reference.path)
      tendon_.reference +=
          segment.share * place_segment(at_reference, segment, world, false).length.length;
  }

 private:
  const Site& find_site(const Element& part, const char* key) const {
    const std::string name = Values(document_, part).text(key);
    const auto found = bodies_.sites.find(name);
    if (found == bodies_.sites.end())
      document_.fail(part, fmt::format("{}: there is no site '{}'", key, name));
    return found->second;
  }

  void read_wrap(const Element& part, Place& place) const {
    const std::string name = Values(document_, part).text("geom");
    const auto found = bodies_.geom_names.find(name);
    if (found == bodies_.geom_names.end())
      document_.fail(part, fmt::format("there is no geom '{}'", name));
    const Geom& geom = bodies_.geoms[static_cast<std::size_t>(found->second)];
    if (geom.type != "sphere" && geom.type != "cylinder")
      document_.fail(part, fmt::format("geom '{}' is a {}; a sphere or cylinder is expected", name,
                                       geom.type));
    place.kind = geom.type == "sphere" ? Place::Kind::kSphere : Place::Kind::kCylinder;
    place.link = bodies_.bodies[static_cast<std::size_t>(geom.body)].link;
    place.X_LG = geom.X_BG;
    place.radius = geom.size[0];
    if (!part.Attribute("sidesite")) return;
    const Site& side = find_site(part, "sidesite");
    if (side.body != geom.body)
      document_.fail(part, "sidesite: a site on the body of the geom is expected");
    place.side = geom.X_BG.inverse() * side.X_BS.translation;
  }

  const Document& document_;
  const Bodies& bodies_;
  TendonElement& tendon_;
};

void read_sum(const Document& document, const Bodies& bodies, const MjcfModel& model,
              TendonElement& tendon) {
  for (const Element* part : document.children(*tendon.element)) {
    const auto joint = bodies.joint_names.find(Values(document, *part).text("joint"));
    if (joint == bodies.joint_names.end()) document.fail(*part, "there is no such joint");
    const Joint& found = bodies.joints[joint->second];
    const double coefficient = Values(document, *part).number("coef", 0.0);
    tendon.sum.emplace_back(found.spec, coefficient);
    tendon.reference += coefficient * found.reference;
    tendon.spec.joints.emplace_back(model.robot.joints[found.spec].name, coefficient);
  }
}

}  // namespace

Tendons read_tendons(Document& document, const Bodies& bodies, const MjcfModel& model) {
  Tendons out;
  document.each(document.section_children("tendon"), [&](const Element& e) {
    TendonElement tendon;
    tendon.element = &e;
    const std::string kind = e.Name(), name = name_of(e);
    if (kind != "fixed" && kind != "spatial")
      document.fail(e, "a <fixed> or <spatial> tendon is expected");
    tendon.fixed = kind == "fixed";
    tendon.spec.name = tendon.name = name.empty() ? fmt::format("tendon{}", out.size()) : name;
    tendon.spec.where = document.where(e);
    if (tendon.fixed) read_sum(document, bodies, model, tendon);
    if (!tendon.fixed) PathReader(document, bodies, tendon).read();
    if (!out.emplace(tendon.name, tendon).second)
      document.fail(e, "there is already a tendon of this name");
  });
  return out;
}

void apply_tendon_forces(Document& document, const Defaults& defaults, const Tendons& tendons,
                         const Couplings& couplings, MjcfModel& model) {
  for (const auto& [name, tendon] : tendons)
    document.faults.collect(
        [&, &one = tendon] { apply_one(document, defaults, one, couplings, model); });
}

}  // namespace counterpoint::mjcf
