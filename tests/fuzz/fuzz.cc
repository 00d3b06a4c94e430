#include "fuzz/fuzz.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "counterpoint/model/geometry.h"
#include "support/temp_folder.h"

namespace counterpoint::fuzz {
namespace {

void require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "a model was accepted that is wrong: %s\n", what);
  std::abort();
}

bool is_rotation(const Matrix3& R) {
  // URDF angles and quaternions are normalized in double precision, with a round-off far below
  // 1e-9.
  return (R.transpose() * R).isIdentity(1e-9) && R.determinant() > 0.0;
}

bool is_pose(const Pose& X) { return X.translation.allFinite() && is_rotation(X.rotation); }

bool is_size(const Shape& shape) {
  switch (shape.type) {
    case ShapeType::kPlane:
      return true;
    case ShapeType::kSphere:
      return std::isfinite(shape.size[0]) && shape.size[0] > 0.0;
    case ShapeType::kBox:
      return shape.size.allFinite() && (shape.size.array() > 0.0).all();
    case ShapeType::kCapsule:
    case ShapeType::kCylinder:
      return shape.size.allFinite() && shape.size[0] > 0.0 && shape.size[1] >= 0.0;
    case ShapeType::kConvexMesh:
      return shape.mesh != nullptr && shape.mesh->vertices.size() >= 4 &&
             shape.mesh->volume > 0.0 && std::isfinite(shape.mesh->volume) &&
             std::isfinite(shape.mesh->radius);
    case ShapeType::kTerrain:
      return shape.terrain != nullptr && !shape.terrain->triangles.empty() &&
             shape.terrain->low.allFinite() && shape.terrain->high.allFinite();
  }
  return false;
}

}  // namespace

const std::filesystem::path& folder() {
  static const test::TempFolder folder(std::filesystem::is_directory("/dev/shm")
                                           ? std::filesystem::path("/dev/shm")
                                           : std::filesystem::temp_directory_path());
  return folder.path();
}

std::filesystem::path write(const char* name, std::string_view content) {
  const std::filesystem::path file = folder() / name;
  std::FILE* stream = std::fopen(file.c_str(), "wb");
  if (stream == nullptr) std::abort();
  const bool written = std::fwrite(content.data(), 1, content.size(), stream) == content.size();
  if (std::fclose(stream) != 0 || !written) std::abort();
  return file;
}

void check(const Model& model) {
  require(model.gravity().allFinite(), "gravity");
  require(model.default_q().allFinite() && model.default_q().size() == model.nq(), "default_q");
  for (const VectorX* values : {&model.damping(), &model.armature(), &model.dry_friction()}) {
    require(values->size() == model.nv() && values->allFinite() && (values->array() >= 0.0).all(),
            "damping, armature or dry friction");
  }
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    require(body.parent >= 0 && body.parent < i, "parent");
    require(is_pose(body.X_PJ), "X_PJ");
    require(std::isfinite(body.inertia.mass) && body.inertia.mass >= 0.0, "mass");
    require(body.inertia.center.allFinite() && body.inertia.rotational.allFinite(), "inertia");
    const JointInfo& joint = model.joint(i - 1);
    require(joint.lower <= joint.upper, "limits");
    require(joint.effort_limit >= 0.0 && joint.velocity_limit > 0.0, "motor limits");
  }
  for (const Geometry& geometry : model.geometries()) {
    require(geometry.body >= 0 && geometry.body < model.num_bodies(), "body of a geometry");
    require(is_pose(geometry.X_BG), "X_BG");
    require(is_size(geometry.shape), "size of a geometry");
    const Material& m = geometry.material;
    for (const double value :
         {m.friction, m.restitution, m.torsional_friction, m.rolling_friction}) {
      require(std::isfinite(value) && value >= 0.0, "material");
    }
  }
}

namespace {

/// The function of the target that the environment variable FUZZ_TARGET names.
auto selected_target() {
  struct Target {
    std::string_view name;
    void (*read)(std::string_view input);
  };
  constexpr Target kTargets[] = {{"urdf", read_urdf},
                                 {"mjcf", read_mjcf},
                                 {"sdf", read_sdf},
                                 {"srdf", read_srdf},
                                 {"scene", read_scene},
                                 {"mesh_dae", read_mesh_dae},
                                 {"mesh_obj", read_mesh_obj},
                                 {"mesh_pieces", read_mesh_pieces},
                                 {"mesh_stl", read_mesh_stl},
                                 {"height_image", read_height_image},
                                 {"height_table", read_height_table},
                                 {"bvh", read_bvh},
                                 {"c3d", read_c3d},
                                 {"csv", read_csv},
                                 {"hdf5", read_hdf5},
                                 {"mcap", read_mcap},
                                 {"npz", read_npz},
                                 {"trc", read_trc},
                                 {"column_map", read_column_map},
                                 {"contact_problem", read_contact_problem},
                                 {"live_message", read_live_message}};
  const char* name = std::getenv("FUZZ_TARGET");
  for (const Target& target : kTargets)
    if (name != nullptr && target.name == name) return target.read;
  std::fprintf(stderr, "FUZZ_TARGET must name a target, one of");
  for (const Target& target : kTargets) std::fprintf(stderr, " %s", target.name.data());
  std::fprintf(stderr, "\n");
  std::exit(2);
}

}  // namespace
}  // namespace counterpoint::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const auto read = counterpoint::fuzz::selected_target();
  try {
    read({reinterpret_cast<const char*>(data), size});
  } catch (const counterpoint::InputError& error) {
    // A refusal is a valid outcome, but its message must not be empty.
    if (*error.what() == '\0') std::abort();
  }
  return 0;
}
