#include "counterpoint/model/export/mjcf_tendons.h"

#include <cmath>

namespace counterpoint {
namespace {

/// One element of a path: a point, a shape around which it runs, or a pulley.
struct PathElement {
  const TendonPoint* point = nullptr;
  int wrap = -1;         ///< index into Tendon::wraps, or -1
  double divisor = 0.0;  ///< divisor of a pulley [-]
};

/// Returns the elements of a path. A branch whose start is the end of the one before, with the same
/// share of the force, continues it: the lengths are equal.
std::vector<PathElement> path_elements(const Tendon& tendon) {
  std::vector<PathElement> out;
  const TendonSegment* last = nullptr;
  for (const TendonSegment& segment : tendon.path) {
    const bool continues = last && last->share == segment.share &&
                           last->to.body == segment.from.body &&
                           last->to.position == segment.from.position;
    if (!continues) {
      if (last || segment.share != 1.0) out.push_back({nullptr, -1, 1.0 / segment.share});
      out.push_back({&segment.from});
    }
    if (segment.wrap >= 0) out.push_back({nullptr, segment.wrap});
    out.push_back({&segment.to});
    last = &segment;
  }
  return out;
}

/// Returns the name of the site or geom of a path's element.
std::string element_name(const Tendon& tendon, std::size_t index) {
  return fmt::format("{}/{}", tendon.name, index);
}

/// Writes a sphere or cylinder of a path, and the site on whose side it passes.
void write_wrap(const TendonWrap& wrap, const std::string& name, MjcfXml& xml) {
  // Paths run around endless cylinders: the half-length of this one has no effect.
  xml.element("geom", {{"name", name},
                       {"type", wrap.cylinder ? "cylinder" : "sphere"},
                       {"size", wrap.cylinder ? export_numbers({wrap.radius, wrap.radius})
                                              : export_number(wrap.radius)},
                       {"pos", export_numbers(wrap.X_BG.translation)},
                       {"quat", export_quaternion(wrap.X_BG.rotation)},
                       {"group", "3"},
                       {"contype", "0"},
                       {"conaffinity", "0"},
                       {"mass", "0"}});
  if (wrap.side) xml.site(name + "/side", {Matrix3::Identity(), wrap.X_BG * *wrap.side});
}

void write_forces(const Tendon& t, MjcfXml& xml, std::vector<Note>& lost) {
  const auto lose = [&](const char* what) { lost.push_back({"tendon '" + t.name + "'", what}); };
  if (t.stiffness > 0.0 && t.rest_shortest < 0.0) {
    lose("a spring whose rest length is negative");
  } else if (t.stiffness > 0.0) {
    xml.set("stiffness", t.stiffness);
    xml.set("springlength", export_numbers({t.rest_shortest, t.rest_longest}));
  }
  if (t.damping > 0.0) xml.set("damping", t.damping);
  if (t.dry_friction > 0.0) xml.set("frictionloss", t.dry_friction);
  if (t.lower == t.upper) {
    lose("equal limits of its length");
  } else if (std::isfinite(t.lower) || std::isfinite(t.upper)) {
    xml.set("limited", "true");
    xml.set("range", mjcf_range(t.lower, t.upper));
  }
}

void write_path(const Tendon& tendon, MjcfXml& xml) {
  const std::vector<PathElement> path = path_elements(tendon);
  for (std::size_t i = 0; i < path.size(); ++i) {
    const std::string name = element_name(tendon, i);
    if (path[i].point) {
      xml.element("site", {{"site", name}});
    } else if (path[i].wrap < 0) {
      xml.element("pulley", {{"divisor", export_number(path[i].divisor)}});
    } else {
      xml.open("geom");
      xml.set("geom", name);
      if (tendon.wraps[static_cast<std::size_t>(path[i].wrap)].side)
        xml.set("sidesite", name + "/side");
      xml.close();
    }
  }
}

}  // namespace

std::string mjcf_rod_name(const Model& model, const Closure& rod) {
  return model.find_tendon(rod.name) < 0 ? rod.name : rod.name + "/rod";
}

void write_mjcf_anchors(const Model& model, const std::vector<Closure>& closures, int body,
                        MjcfXml& xml) {
  for (const Tendon& tendon : model.tendons()) {
    const std::vector<PathElement> path = path_elements(tendon);
    for (std::size_t i = 0; i < path.size(); ++i) {
      const std::string name = element_name(tendon, i);
      if (path[i].point && path[i].point->body == body)
        xml.site(name, {Matrix3::Identity(), path[i].point->position});
      if (path[i].wrap < 0) continue;
      const TendonWrap& wrap = tendon.wraps[static_cast<std::size_t>(path[i].wrap)];
      if (wrap.body == body) write_wrap(wrap, name, xml);
    }
  }
  for (const Closure& c : closures) {
    if (c.type != ClosureType::kDistance) continue;
    if (c.body_a == body) xml.site(mjcf_rod_name(model, c) + "/a", c.X_AC);
    if (c.body_b == body) xml.site(mjcf_rod_name(model, c) + "/b", c.X_BC);
  }
}

void write_mjcf_tendons(const Model& model, const std::vector<Closure>& closures, bool forces,
                        MjcfXml& xml, std::vector<Note>& lost) {
  xml.open("tendon");
  for (const Tendon& tendon : model.tendons()) {
    xml.open(tendon.is_spatial() ? "spatial" : "fixed");
    xml.set("name", tendon.name);
    if (forces) write_forces(tendon, xml, lost);
    write_path(tendon, xml);
    for (const TendonJoint& term : tendon.joints)
      xml.element("joint", {{"joint", mjcf_joint_name(model, term.joint)},
                            {"coef", export_number(term.coefficient)}});
    xml.close();
  }
  for (const Closure& c : closures) {
    if (c.type != ClosureType::kDistance) continue;
    const std::string name = mjcf_rod_name(model, c);
    xml.open("spatial");
    xml.set("name", name);
    for (const char* end : {"/a", "/b"}) xml.element("site", {{"site", name + end}});
    xml.close();
  }
  xml.close();
}

}  // namespace counterpoint
