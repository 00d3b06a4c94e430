#include "counterpoint/model/mjcf/document/compiler.h"

#include <fmt/format.h>

#include <cstring>

#include "counterpoint/model/mjcf/document/document.h"

namespace counterpoint::mjcf {
namespace {

std::string folder_text(std::string folder) {
  if (!folder.empty() && folder.back() != '/' && folder.back() != '\\') folder += '/';
  for (char& c : folder)
    if (c == '\\') c = '/';
  return folder;
}

Matrix3 about(char axis, double angle) {
  Vector3 direction = Vector3::Zero();
  direction[axis - 'x'] = 1.0;
  return Eigen::AngleAxisd(angle, direction).toRotationMatrix();
}

Vector3 direction(const Values& values, const Element& level, const Vector3& v, const char* name) {
  const double length = v.norm();
  if (length > 1e-10) return v / length;
  values.document().fail(level, fmt::format("{}: a direction cannot be zero", name));
}

}  // namespace

/// Lower-case letters rotate about the axes of the rotated frame (intrinsic), upper-case letters
/// about those of the parent (extrinsic).
Matrix3 from_euler(const std::vector<double>& angles, const Compiler& compiler) {
  Matrix3 R = Matrix3::Identity();
  for (int i = 0; i < 3; ++i) {
    const char c = compiler.euler_sequence[static_cast<std::size_t>(i)];
    const double angle = angles[static_cast<std::size_t>(i)] * compiler.angle_unit;
    if (c >= 'x')
      R = R * about(c, angle);
    else
      R = about(static_cast<char>(c - 'X' + 'x'), angle) * R;
  }
  return R;
}

Matrix3 shortest_from_z(const Vector3& v) {
  const Vector3 axis = Vector3::UnitZ().cross(v);
  const double sine = axis.norm();
  const Vector3 about = sine < 1e-10 ? Vector3(Vector3::UnitX()) : Vector3(axis / sine);
  return Eigen::AngleAxisd(std::atan2(sine, v.z()), about).toRotationMatrix();
}

Compiler read_compiler(Document& document, const Element& root) {
  Compiler out;
  bool in_degrees = true;
  std::string asset_folder, mesh_folder;
  for (const Element* e : document.children(root)) {
    if (std::strcmp(e->Name(), "compiler") != 0) continue;
    document.expect(
        *e,
        {"angle",         "eulerseq",     "autolimits",      "meshdir",           "assetdir",
         "texturedir",    "strippath",    "inertiafromgeom", "inertiagrouprange", "balanceinertia",
         "boundmass",     "boundinertia", "settotalmass",    "coordinate",        "fusestatic",
         "discardvisual", "usethread",    "fitaabb",         "exactmeshinertia",  "convexhull",
         "alignfree",     "saveinertial", "conflict"});
    const Values v(document, *e);
    in_degrees =
        v.word("angle", {"radian", "degree"}, in_degrees ? "degree" : "radian") == "degree";
    out.euler_sequence = v.text("eulerseq", out.euler_sequence);
    if (out.euler_sequence.size() != 3 ||
        out.euler_sequence.find_first_not_of("xyzXYZ") != std::string::npos)
      document.fail(*e, "eulerseq: three of the letters xyzXYZ are expected");
    out.auto_limits = v.boolean("autolimits", out.auto_limits);
    asset_folder = v.text("assetdir", asset_folder);
    mesh_folder = v.text("meshdir", mesh_folder);
    out.strip_path = v.boolean("strippath", out.strip_path);
    if (v.has("inertiafromgeom")) {
      const std::string word = v.word("inertiafromgeom", {"true", "false", "auto"}, "auto");
      out.inertia_from_geom = word == "true"    ? Compiler::InertiaFromGeom::kAlways
                              : word == "false" ? Compiler::InertiaFromGeom::kNever
                                                : Compiler::InertiaFromGeom::kAuto;
    }
    if (const auto range = v.integers("inertiagrouprange", 2, 2); !range.empty()) {
      out.first_inertia_group = range[0];
      out.last_inertia_group = range[1];
    }
    out.balance_inertia = v.boolean("balanceinertia", out.balance_inertia);
    out.least_mass = v.number("boundmass", out.least_mass);
    out.least_inertia = v.number("boundinertia", out.least_inertia);
    out.total_mass = v.number("settotalmass", out.total_mass);
    out.fit_aabb = v.boolean("fitaabb", out.fit_aabb);
    out.align_free = v.boolean("alignfree", out.align_free);
    out.merge_options = v.word("conflict", {"warning", "merge", "error"}, "warning") == "merge";
    if (v.text("coordinate", "local") != "local")
      document.fail(
          *e,
          "coordinate: MuJoCo itself takes local only since version 2.3.4; save the model "
          "anew with an older one");
    if (v.boolean("exactmeshinertia", false))
      document.fail(*e, "exactmeshinertia: give the meshes inertia=\"exact\"");
  }
  out.angle_unit = in_degrees ? EIGEN_PI / 180.0 : 1.0;
  out.mesh_folder = folder_text(mesh_folder.empty() ? asset_folder : mesh_folder);
  return out;
}

Matrix3 rotation_of(const double* q) {
  return Quaternion(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
}

std::optional<Matrix3> orientation_of(const Values& values) {
  const Compiler& compiler = values.document().compiler(values.element());
  const Element* level = values.level_of_any({"quat", "axisangle", "xyaxes", "zaxis", "euler"});
  if (level == nullptr) return std::nullopt;
  const Values own(values.document(), *level);
  // The other notations take precedence over quat.
  if (const auto a = own.numbers("axisangle", 4, 4); !a.empty()) {
    const Vector3 axis = direction(own, *level, {a[0], a[1], a[2]}, "axisangle");
    return Eigen::AngleAxisd(a[3] * compiler.angle_unit, axis).toRotationMatrix();
  }
  if (const auto a = own.numbers("xyaxes", 6, 6); !a.empty()) {
    const Vector3 x = direction(own, *level, {a[0], a[1], a[2]}, "xyaxes");
    Vector3 y(a[3], a[4], a[5]);
    y = direction(own, *level, y - x * x.dot(y), "xyaxes");
    Matrix3 R;
    R << x, y, x.cross(y);
    return R;
  }
  if (own.has("zaxis"))
    return shortest_from_z(direction(own, *level, own.vector("zaxis", Vector3::UnitZ()), "zaxis"));
  if (const auto a = own.numbers("euler", 3, 3); !a.empty()) return from_euler(a, compiler);
  const std::vector<double> q = own.numbers("quat", 4, 4);
  if (Eigen::Map<const Eigen::Vector4d>(q.data()).norm() < 1e-10)
    values.document().fail(*level, "quat: a quaternion (w x y z) cannot be zero");
  return rotation_of(q.data());
}

Pose pose_of(const Values& values) {
  return {orientation_of(values).value_or(Matrix3::Identity()),
          values.vector("pos", Vector3::Zero())};
}

}  // namespace counterpoint::mjcf
