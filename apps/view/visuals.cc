#include "view/visuals.h"

#include <fmt/format.h>
#include <tinyxml2.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <unordered_map>

#include "counterpoint/model/robot_files.h"
#include "counterpoint/model/spatial.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint::view {
namespace {

namespace fs = std::filesystem;
using Packages = std::map<std::string, fs::path>;
using tinyxml2::XMLElement;

/// A robot of the scene, in the order of the model's instances.
struct Robot {
  fs::path file;  ///< empty for a shape defined in the scene file
  std::string prefix;
  fs::path mesh = {};  ///< the file of an object that fills a mesh; else empty
  Vector3 scale = Vector3::Ones();
};

/// Parses `count` numbers between blanks; returns nothing if one is missing or not finite.
std::optional<std::vector<double>> numbers(const char* text, size_t count) {
  std::vector<double> out;
  if (!text) return std::nullopt;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    const std::optional<double> value = parse_number(word);
    if (!value || !std::isfinite(*value)) return std::nullopt;
    out.push_back(*value);
  }
  if (out.size() != count) return std::nullopt;
  return out;
}

std::string robot_name(const fs::path& file) {
  tinyxml2::XMLDocument document;
  parse_xml_file(file, "there is no such file", document);
  const XMLElement* robot = document.RootElement();
  const char* name = robot ? robot->Attribute("name") : nullptr;
  return name ? name : "";
}

/// Lists the robots with the names and order that scene_models.cc gives them.
std::vector<Robot> robots_of(const fs::path& scene_file, Packages& packages) {
  if (scene_file.extension() == ".urdf") return {{scene_file, ""}};
  // Robots from MJCF and SDF files are shown by their collision shapes.
  for (const char* extension : {".mjcf", ".sdf", ".world"})
    if (scene_file.extension() == extension) return {};
  if (scene_file.extension() == ".xml") {
    if (is_mjcf(scene_file) || is_sdf(scene_file)) return {};
    return {{scene_file, ""}};
  }
  const YAML::Node scene = YAML::LoadFile(scene_file.string());
  const fs::path folder = scene_file.parent_path();
  for (const auto& entry : scene["packages"])
    packages.emplace(entry.first.as<std::string>(), folder / entry.second.as<std::string>());
  std::vector<Robot> robots;
  const YAML::Node models = scene["models"];
  for (const YAML::Node& entry : models) {
    Robot robot;
    std::string name;
    if (entry["urdf"]) {
      const std::string text = entry["urdf"].as<std::string>(), scheme = "package://";
      robot.file = folder / text;
      if (text.starts_with(scheme)) {
        const std::string rest = text.substr(scheme.size());
        const size_t slash = rest.find('/');
        const auto listed = packages.find(rest.substr(0, slash));
        if (listed != packages.end() && slash != std::string::npos)
          robot.file = listed->second / rest.substr(slash + 1);
      }
      name = robot_name(robot.file);
    }
    if (entry["mesh"]) robot.mesh = folder / entry["mesh"].as<std::string>();
    if (entry["mesh"] && entry["scale"])
      robot.scale = Vector3(entry["scale"].as<std::vector<double>>().data());
    if (entry["name"]) name = entry["name"].as<std::string>();
    const int count = entry["count"] ? entry["count"].as<int>() : 1;
    const bool bare = models.size() == 1 && count == 1 && !entry["name"];
    for (int i = 0; i < count; ++i) {
      robot.prefix = bare ? "" : name + (count > 1 ? std::to_string(i) : "") + "/";
      robots.push_back(robot);
    }
  }
  return robots;
}

/// The visuals of one file by link, in the frame of the link.
class RobotFile {
 public:
  RobotFile(const fs::path& file, const Packages& packages, Visuals& out)
      : file_(file), packages_(packages), out_(out) {
    parse_xml_file(file, "there is no such file", document_);
    const XMLElement* robot = document_.RootElement();
    if (!robot) return;
    for (const XMLElement* m = robot->FirstChildElement("material"); m;
         m = m->NextSiblingElement("material"))
      if (m->Attribute("name")) colors_[m->Attribute("name")] = color_of(m);
    for (const XMLElement* link = robot->FirstChildElement("link"); link;
         link = link->NextSiblingElement("link"))
      for (const XMLElement* v = link->FirstChildElement("visual"); v;
           v = v->NextSiblingElement("visual"))
        if (link->Attribute("name")) read(v, link->Attribute("name"));
  }

  const std::vector<Visual>& visuals() const { return visuals_; }

 private:
  using Color = std::optional<std::array<double, 4>>;

  static Color color_of(const XMLElement* material) {
    const XMLElement* color = material->FirstChildElement("color");
    const auto rgba = numbers(color ? color->Attribute("rgba") : nullptr, 4);
    if (!rgba) return std::nullopt;
    std::array<double, 4> out{};
    for (size_t i = 0; i < 4; ++i) out[i] = std::clamp((*rgba)[i], 0.0, 1.0);
    return out;
  }

  void note(const XMLElement* e, const std::string& why) {
    out_.notes.push_back(
        fmt::format("{}:{}: a visual is not shown: {}", file_.string(), e->GetLineNum(), why));
  }

  void read(const XMLElement* e, const std::string& link) {
    Visual visual;
    visual.name = link;
    if (const XMLElement* origin = e->FirstChildElement("origin")) {
      const auto xyz = numbers(origin->Attribute("xyz"), 3),
                 rpy = numbers(origin->Attribute("rpy"), 3);
      if ((origin->Attribute("xyz") && !xyz) || (origin->Attribute("rpy") && !rpy))
        return note(e, "its origin is not three numbers each");
      if (xyz) visual.X_BV.translation = Vector3(xyz->data());
      if (rpy) visual.X_BV.rotation = rotation_from_rpy((*rpy)[0], (*rpy)[1], (*rpy)[2]);
    }
    if (const XMLElement* material = e->FirstChildElement("material")) {
      visual.color = color_of(material);
      const auto named =
          colors_.find(material->Attribute("name") ? material->Attribute("name") : "");
      if (!visual.color && named != colors_.end()) visual.color = named->second;
    }
    const XMLElement* geometry = e->FirstChildElement("geometry");
    const XMLElement* shape = geometry ? geometry->FirstChildElement() : nullptr;
    if (!shape) return note(e, "it has no geometry");
    if (read_shape(shape, visual)) visuals_.push_back(visual);
  }

  bool read_shape(const XMLElement* e, Visual& out) {
    const std::string kind = e->Name();
    const auto radius = numbers(e->Attribute("radius"), 1),
               length = numbers(e->Attribute("length"), 1);
    const auto sides = numbers(e->Attribute("size"), 3);
    const auto is = [&](ShapeType type, const Vector3& size) {
      if (size.minCoeff() < 0.0) return note(e, "a negative size"), false;
      out.shape.type = type;
      out.shape.size = size;
      return true;
    };
    if (kind == "mesh") return read_mesh(e, out);
    if (kind == "box" && sides) return is(ShapeType::kBox, 0.5 * Vector3(sides->data()));
    if (kind == "sphere" && radius) return is(ShapeType::kSphere, {(*radius)[0], 0, 0});
    if (kind == "cylinder" && radius && length)
      return is(ShapeType::kCylinder, {(*radius)[0], 0.5 * (*length)[0], 0});
    if (kind == "capsule" && radius && length)
      return is(ShapeType::kCapsule, {(*radius)[0], 0.5 * (*length)[0], 0});
    note(e, fmt::format("<{}> is no shape that is known, or its sizes are missing", kind));
    return false;
  }

  bool read_mesh(const XMLElement* e, Visual& out) {
    const auto scale = numbers(e->Attribute("scale"), 3);
    const Vector3 by = scale ? Vector3(scale->data()) : Vector3(Vector3::Ones());
    const char* name = e->Attribute("filename");
    if (!name) return note(e, "<mesh> names no file"), false;
    const std::string key = fmt::format("{} {} {} {}", name, by.x(), by.y(), by.z());
    const auto [entry, is_new] = meshes_.try_emplace(key, -1);
    if (is_new) {
      try {
        const MeshPath path = find_mesh(name, file_.parent_path(), packages_, file_.string());
        out_.meshes.push_back(load_mesh(path.file, by));
        entry->second = static_cast<int>(out_.meshes.size()) - 1;
      } catch (const std::exception& error) {  // a missing appearance is no reason to fail
        note(e, error.what());
      }
    }
    out.shape.type = ShapeType::kConvexMesh;
    out.mesh = entry->second;
    return out.mesh >= 0;
  }

  fs::path file_;
  const Packages& packages_;
  Visuals& out_;
  tinyxml2::XMLDocument document_;
  std::map<std::string, Color> colors_;
  std::map<std::string, int> meshes_;
  std::vector<Visual> visuals_;
};

/// True if a collision shape of the same body coincides with the visual.
bool is_collision_shape(const Visual& visual, const Model& model) {
  constexpr double kSame = 1e-9;  // [m], and without unit for rotations
  if (visual.mesh >= 0) return false;
  return std::any_of(
      model.geometries().begin(), model.geometries().end(), [&](const Geometry& geometry) {
        return geometry.body == visual.body && geometry.shape.type == visual.shape.type &&
               (geometry.shape.size - visual.shape.size).norm() < kSame &&
               (geometry.X_BG.translation - visual.X_BV.translation).norm() < kSame &&
               (geometry.X_BG.rotation - visual.X_BV.rotation).norm() < kSame;
      });
}

/// Mesh files by path and scale, as indices into Visuals::meshes.
using MeshIndices = std::map<std::pair<fs::path, std::array<double, 3>>, int>;

/// Adds the mesh of an object that collides as convex pieces; false if it collides as its hull.
bool add_object(const Robot& object, const Model& model, MeshIndices& meshes, Visuals& out) {
  const auto piece =
      std::find_if(model.geometries().begin(), model.geometries().end(),
                   [&](const Geometry& g) { return g.name == object.prefix + "body/shape#0"; });
  if (piece == model.geometries().end()) return false;
  const Vector3& by = object.scale;
  const auto [entry, is_new] = meshes.try_emplace({object.mesh, {by.x(), by.y(), by.z()}}, 0);
  if (is_new) {
    entry->second = static_cast<int>(out.meshes.size());
    out.meshes.push_back(load_mesh(object.mesh, by));
  }
  Visual& visual = out.shapes.emplace_back();
  visual.name = object.prefix + "body";
  visual.body = piece->body;
  visual.X_BV = piece->X_BG;
  visual.shape.type = ShapeType::kConvexMesh;
  visual.mesh = entry->second;
  return true;
}

void limit_triangles(Visuals& visuals) {
  size_t before = 0, after = 0, wanted = 0;
  for (const TriangleMesh& mesh : visuals.meshes) {
    before += mesh.triangles.size();
    wanted += std::min(mesh.triangles.size(), kMaxVisualTriangles);
  }
  const double share = std::min(1.0, static_cast<double>(kMaxAllVisualTriangles) /
                                         static_cast<double>(std::max<size_t>(1, wanted)));
  for (TriangleMesh& mesh : visuals.meshes) {
    const size_t most = std::min(mesh.triangles.size(), kMaxVisualTriangles);
    make_coarser(mesh, static_cast<size_t>(share * static_cast<double>(most)));
    after += mesh.triangles.size();
  }
  if (after < before)
    visuals.notes.push_back(
        fmt::format("visual meshes are shown with {} of {} triangles", after, before));
}

}  // namespace

void make_coarser(TriangleMesh& mesh, size_t most) {
  if (mesh.triangles.size() <= most || mesh.vertices.empty()) return;
  Vector3 low = mesh.vertices[0], high = low;
  for (const Vector3& v : mesh.vertices) {
    low = low.cwiseMin(v);
    high = high.cwiseMax(v);
  }
  const double side = (high - low).maxCoeff();
  if (!(side > 0.0)) return;
  for (double cells = 512.0; cells >= 1.0; cells *= 0.75) {
    std::unordered_map<std::uint64_t, int> index;
    std::vector<int> merged;
    for (const Vector3& v : mesh.vertices) {
      std::uint64_t key = 0;
      for (int i = 0; i < 3; ++i)
        key = 1024 * key + static_cast<std::uint64_t>(cells * (v[i] - low[i]) / side);
      merged.push_back(index.try_emplace(key, static_cast<int>(index.size())).first->second);
    }
    TriangleMesh coarse;
    for (const auto& [a, b, c] : mesh.triangles) {
      const std::array<int, 3> t{merged[a], merged[b], merged[c]};
      if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) coarse.triangles.push_back(t);
    }
    if (coarse.triangles.size() > most) continue;
    std::vector<int> count(index.size(), 0);
    coarse.vertices.assign(index.size(), Vector3::Zero());
    for (size_t i = 0; i < merged.size(); ++i) {
      coarse.vertices[merged[i]] += mesh.vertices[i];
      ++count[merged[i]];
    }
    for (size_t i = 0; i < count.size(); ++i) coarse.vertices[i] /= count[i];
    mesh = std::move(coarse);
    return;
  }
}

Visuals read_visuals(const fs::path& scene_file, const Model& model,
                     const std::map<std::string, fs::path>& given_packages) {
  Visuals out;
  Packages packages = given_packages;
  std::map<std::string, const Frame*> frames;
  for (const Frame& frame : model.frames()) frames[frame.name] = &frame;
  std::map<fs::path, std::unique_ptr<RobotFile>> files;
  MeshIndices meshes;
  bool new_looks = false;
  const std::vector<Robot> robots = robots_of(scene_file, packages);
  for (size_t i = 0; i < robots.size(); ++i) {
    if (!robots[i].mesh.empty() && add_object(robots[i], model, meshes, out)) {
      out.shapes.back().instance = static_cast<int>(i);
      out.instances.push_back(static_cast<int>(i));
      new_looks = true;
    }
    if (robots[i].file.empty()) continue;
    auto& file = files[robots[i].file];
    if (!file) file = std::make_unique<RobotFile>(robots[i].file, packages, out);
    for (Visual visual : file->visuals()) {
      const auto frame = frames.find(robots[i].prefix + visual.name);
      if (frame == frames.end()) continue;
      visual.name = frame->first;
      visual.body = frame->second->body;
      visual.instance = static_cast<int>(i);
      visual.X_BV = frame->second->X_BF * visual.X_BV;
      new_looks = new_looks || !is_collision_shape(visual, model);
      out.shapes.push_back(std::move(visual));
    }
    if (!file->visuals().empty()) out.instances.push_back(static_cast<int>(i));
  }
  if (!new_looks) {
    out.shapes.clear();
    out.instances.clear();
    out.meshes.clear();
  }
  limit_triangles(out);
  return out;
}

}  // namespace counterpoint::view
