#include <fmt/format.h>
#include <tinyxml2.h>

#include "counterpoint/model/mjcf/bodies/bodies.h"
#include "counterpoint/model/model.h"

namespace counterpoint::mjcf {
namespace {

SpatialInertia read_inertial(const Document& document, const Element& element) {
  document.expect(element, {"pos", "quat", "axisangle", "xyaxes", "zaxis", "euler", "mass",
                            "diaginertia", "fullinertia"});
  const Values v(document, element);
  if (!v.has("mass") || !v.has("pos")) document.fail(element, "mass and pos are expected");
  const Pose X_BI = pose_of(v);
  SpatialInertia inertia;
  inertia.mass = v.number("mass", 0.0);
  if (const auto f = v.numbers("fullinertia", 6, 6); !f.empty()) {
    inertia.rotational << f[0], f[3], f[4], f[3], f[1], f[5], f[4], f[5], f[2];
  } else {
    inertia.rotational = v.vector("diaginertia", Vector3::Zero()).asDiagonal();
  }
  return inertia.transformed(X_BI);
}

/// Sums the inertias of a body's geoms in the groups of inertiagrouprange.
SpatialInertia from_geoms(Document& document, Assets& assets, const Bodies& bodies, int body) {
  const Compiler& compiler = document.compiler(*bodies.bodies[body].element);
  SpatialInertia sum;
  for (const Geom& geom : bodies.geoms) {
    if (geom.body != body || geom.group < compiler.first_inertia_group ||
        geom.group > compiler.last_inertia_group)
      continue;
    sum = sum + inertia_of(geom, assets, document);
  }
  return sum;
}

/// Applies boundmass, then balanceinertia (moments that violate the triangle inequality become
/// their mean), then boundinertia.
void adjust(Document& document, const Element& element, SpatialInertia& inertia) {
  const Compiler& compiler = document.compiler(element);
  inertia.mass = std::max(inertia.mass, compiler.least_mass);
  if (!compiler.balance_inertia && compiler.least_inertia <= 0.0) return;
  const PrincipalAxes principal = principal_axes(inertia.rotational);
  Vector3 m = principal.moments;
  const bool impossible = m[0] + m[1] < m[2];
  if (compiler.balance_inertia && impossible) {
    document.note(element,
                  "moments of inertia that no body has; as balanceinertia asks, all three are "
                  "their mean");
    m.setConstant(m.sum() / 3.0);
  }
  m = m.cwiseMax(compiler.least_inertia);
  if (m == principal.moments) return;
  inertia.rotational = principal.axes * m.asDiagonal() * principal.axes.transpose();
}

SpatialInertia inertia_of_body(Document& document, Assets& assets, const Bodies& bodies, int body,
                               bool total_counts) {
  using Rule = Compiler::InertiaFromGeom;
  const BodyNode& node = bodies.bodies[body];
  const Rule rule = document.compiler(*node.element).inertia_from_geom;
  const bool by_geoms = rule == Rule::kAlways || (rule == Rule::kAuto && !node.inertial);
  // The inertia of a body fixed to the world matters only for settotalmass; else its geoms are not
  // read.
  const bool counts = node.weld != 0 || total_counts;
  SpatialInertia inertia;
  if (node.inertial && !by_geoms)
    inertia = read_inertial(document, *node.inertial);
  else if (by_geoms && counts)
    inertia = from_geoms(document, assets, bodies, body);
  if (counts) adjust(document, *node.element, inertia);
  // No result depends on this inertia, but every joint needs one.
  if (node.mocap && !(inertia.mass > 0.0)) inertia = {1.0, Vector3::Zero(), Matrix3::Identity()};
  if (!document.options().repair_inertias) return inertia;
  const std::string defect = inertia_defect(inertia);
  if (defect.empty()) return inertia;
  document.note(*node.element, defect + "; replaced by the nearest possible");
  return nearest_physical(inertia);
}

}  // namespace

void read_inertias(Document& document, Assets& assets, const Bodies& bodies, MjcfModel& model) {
  const double total_mass = document.compiler(document.root()).total_mass;
  double total = 0.0;
  for (int i = 1; i < static_cast<int>(bodies.bodies.size()); ++i) {
    SpatialInertia& inertia = model.robot.links[bodies.bodies[i].link_index].inertia;
    document.faults.collect(
        [&] { inertia = inertia_of_body(document, assets, bodies, i, total_mass > 0.0); });
    total += inertia.mass;
  }
  if (!(total_mass > 0.0) || !(total > 0.0)) return;
  for (LinkSpec& link : model.robot.links) {
    link.inertia.mass *= total_mass / total;
    link.inertia.rotational *= total_mass / total;
  }
}

}  // namespace counterpoint::mjcf
