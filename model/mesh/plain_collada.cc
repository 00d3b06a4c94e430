#include "counterpoint/model/mesh/plain_collada.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <cstring>
#include <iterator>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "counterpoint/model/limits.h"
#include "counterpoint/model/mesh/collada_nodes.h"
#include "counterpoint/model/mesh/collada_reader.h"
#include "counterpoint/model/spatial.h"
#include "counterpoint/model/text_files.h"

namespace counterpoint {
namespace {

using tinyxml2::XMLElement;

/// Polygons as indices of positions, in the format of <vcount> and <p>.
struct Polygons {
  void add(const long* first, long size) {
    if (size < 3) return;  // a point or an edge
    ++count;
    fmt::format_to(std::back_inserter(sizes), "{} ", size);
    for (long i = 0; i < size; ++i) {
      fmt::format_to(std::back_inserter(corners), "{} ", first[i]);
    }
  }
  int count = 0;
  std::string sizes, corners;
};

class PlainCollada : private ColladaReader {
 public:
  explicit PlainCollada(const std::filesystem::path& file) : ColladaReader(file.string()) {}

  std::string run() {
    tinyxml2::XMLDocument document;
    parse_xml_file(file(), "there is no such mesh file", document);
    const XMLElement* root = document.RootElement();
    if (root == nullptr) throw InputError(fmt::format("{}:1: has no element <COLLADA>", file()));
    if (!is_one_of(*root, {"COLLADA"})) fail(*root, "stands where <COLLADA> is expected");
    if (const auto* second = root->NextSiblingElement()) {
      fail(*second, "stands behind the end of the document's one element");
    }
    collada(*root);
    return out_.CStr();
  }

 private:
  // Each function below checks an element and writes the parts that are kept.

  void open(const char* name) { out_.OpenElement(name, true); }
  void copy(const XMLElement& from, const char* attribute) {
    const char* text = from.Attribute(attribute);
    if (text == nullptr) return;
    // A line break would be read back as a blank, which could turn one name into another.
    for (const char* c = text; *c != '\0'; ++c) {
      if (static_cast<unsigned char>(*c) < ' ') {
        fail(from, fmt::format("has a control character in its {}", attribute));
      }
    }
    out_.PushAttribute(attribute, text);
  }

  void collada(const XMLElement& root) {
    check_collada_nodes(root, *this);
    open("COLLADA");
    out_.PushAttribute("version", "1.4.1");
    if (const auto* e = only(root, "asset")) asset(*e);
    each(root, {"library_geometries"}, [&](const XMLElement& library) {
      open("library_geometries");
      each(library, {"geometry"}, [&](const XMLElement& e) { geometry(e); });
      out_.CloseElement();
    });
    each(root, {"library_nodes", "library_visual_scenes"}, [&](const XMLElement& library) {
      open(library.Name());
      each(library, {"node", "visual_scene"}, [&](const XMLElement& e) { node(e); });
      out_.CloseElement();
    });
    if (const auto* e = only(root, "scene")) scene(*e);
    out_.CloseElement();
  }

  void asset(const XMLElement& asset) {
    open("asset");
    if (const auto* unit = only(asset, "unit")) {
      double metre = 1.0;
      const bool read = unit->Attribute("meter") == nullptr ||
                        unit->QueryDoubleAttribute("meter", &metre) == tinyxml2::XML_SUCCESS;
      if (!read || !(metre > 0.0 && metre <= limits::kMaxLength)) {
        fail(*unit, "needs meter=\"...\", its length in metres");
      }
      open("unit");
      out_.PushAttribute("meter", metre);
      out_.CloseElement();
    }
    if (const auto* up = only(asset, "up_axis")) {
      std::string axis = text(*up);
      axis.erase(0, axis.find_first_not_of(" \t\r\n"));
      axis.erase(axis.find_last_not_of(" \t\r\n") + 1);
      if (axis != "X_UP" && axis != "Y_UP" && axis != "Z_UP") {
        fail(*up, fmt::format("is '{:.16}', neither X_UP, Y_UP nor Z_UP", axis));
      }
      open("up_axis");
      out_.PushText(axis.c_str());
      out_.CloseElement();
    }
    out_.CloseElement();
  }

  void geometry(const XMLElement& geometry) {
    const char* id = geometry.Attribute("id");
    if (!geometries_.insert(id == nullptr ? "" : id).second) {
      fail(geometry, fmt::format("'{}' is there for the second time", id == nullptr ? "" : id));
    }
    if (const auto* e = only(geometry, "convex_mesh")) fail(*e, "is not read, only <mesh> is");
    if (const auto* e = only(geometry, "brep")) fail(*e, "is not read, only <mesh> is");
    open("geometry");
    copy(geometry, "id");
    if (const auto* e = only(geometry, "mesh")) mesh(*e);
    out_.CloseElement();
  }

  void mesh(const XMLElement& mesh) {
    expect_only(mesh, {"source", "vertices", "triangles", "polylist", "polygons", "trifans",
                       "tristrips", "lines", "linestrips"});
    open("mesh");
    if (const auto* vertices = only(mesh, "vertices")) {
      const long points = positions(mesh, *vertices);
      each(mesh, {"triangles", "polylist", "polygons", "trifans", "tristrips"},
           [&](const XMLElement& e) { polygons(e, vertices->Attribute("id"), points); });
    }
    out_.CloseElement();
  }

  /// Writes the positions of a mesh and returns their number.
  long positions(const XMLElement& mesh, const XMLElement& vertices) {
    expect_only(vertices, {"input"});
    const XMLElement* input = nullptr;
    each(vertices, {"input"}, [&](const XMLElement& e) {
      if (e.Attribute("semantic", "POSITION") == nullptr) return;
      if (input != nullptr) fail(e, "gives positions for the second time");
      input = &e;
    });
    if (vertices.Attribute("id") == nullptr || input == nullptr) {
      fail(vertices, "has no id, or no <input> of semantic POSITION");
    }
    const std::string name = reference(*input, "source");
    const XMLElement* source = nullptr;
    each(mesh, {"source"}, [&](const XMLElement& e) {
      if (e.Attribute("id", name.c_str()) == nullptr) return;
      if (source != nullptr) fail(e, fmt::format("'{}' is there for the second time", name));
      source = &e;
    });
    if (source == nullptr) fail(*input, fmt::format("names source '{}', which is not there", name));
    const long points = position_source(*source);
    open("vertices");
    copy(vertices, "id");
    write_input("POSITION", name);
    out_.CloseElement();
    return points;
  }

  long position_source(const XMLElement& source) {
    expect_only(source, {"float_array", "technique_common"});
    const XMLElement& array = the(source, "float_array");
    const long size = static_cast<long>(reals(array).size());
    if (count(array, "count", -1) != size) fail(array, "does not hold as many numbers as it says");
    const XMLElement& common = the(source, "technique_common");
    expect_only(common, {"accessor"});
    const XMLElement& accessor = the(common, "accessor");
    if (array.Attribute("id", reference(accessor, "source").c_str()) == nullptr) {
      fail(accessor, "does not name the array beside it");
    }
    expect_only(accessor, {"param"});
    std::string names;
    each(accessor, {"param"}, [&](const XMLElement& e) {
      const char* name = e.Attribute("name");
      names += name == nullptr ? "?" : name;
    });
    if (names != "XYZ") fail(accessor, "of positions needs <param> X, Y and Z, in this order");
    const long points = count(accessor, "count", 0);
    const long stride = count(accessor, "stride", 1);
    const long offset = count(accessor, "offset", 0);
    if (points > 0 && stride < 3) fail(accessor, "of positions needs a stride of 3 or more");
    if (points > 0 && offset + points * stride > size) {
      fail(accessor, "reaches beyond its array");
    }
    open("source");
    copy(source, "id");
    open("float_array");
    copy(array, "id");
    out_.PushAttribute("count", size);
    out_.PushText(text(array).c_str());
    out_.CloseElement();
    open("technique_common");
    open("accessor");
    copy(accessor, "source");
    out_.PushAttribute("count", points);
    out_.PushAttribute("offset", offset);
    out_.PushAttribute("stride", stride);
    for (const char* name : {"X", "Y", "Z"}) {
      open("param");
      out_.PushAttribute("name", name);
      out_.PushAttribute("type", "float");
      out_.CloseElement();
    }
    for (int i = 0; i < 3; ++i) out_.CloseElement();  // accessor, technique_common, source
    return points;
  }

  void write_input(const char* semantic, const std::string& source) {
    open("input");
    out_.PushAttribute("semantic", semantic);
    out_.PushAttribute("source", ("#" + source).c_str());
    if (std::strcmp(semantic, "VERTEX") == 0) out_.PushAttribute("offset", 0);
    out_.CloseElement();
  }

  /// Writes polygons of any kind as a <polylist> of positions.
  void polygons(const XMLElement& primitives, const char* vertices, long points) {
    const std::string kind = primitives.Name();
    expect_only(primitives, {"input", "p", kind == "polylist" ? "vcount" : "p"});
    if (kind == "triangles" || kind == "polylist") only(primitives, "p");
    Polygons out;
    for (const auto& run : corners(primitives, vertices, points)) {
      const long size = static_cast<long>(run.size());
      if (kind == "triangles") {
        cut(primitives, run, std::vector<long>(size / 3, 3), out);
      } else if (kind == "polylist") {
        cut(primitives, run, integers(the(primitives, "vcount")), out);
      } else if (kind == "polygons") {
        out.add(run.data(), size);
      } else {
        const bool fan = kind == "trifans";
        for (long i = 2; i < size; ++i) {  // every other triangle of a strip is reversed
          const long triangle[] = {run[fan ? 0 : i - 2 + i % 2], run[fan ? i - 1 : i - 1 - i % 2],
                                   run[i]};
          out.add(triangle, 3);
        }
      }
    }
    if (out.count > 0) write_polygons(out, vertices);
  }

  /// Indices of the positions of the corners, one list for each <p>.
  std::vector<std::vector<long>> corners(const XMLElement& primitives, const char* vertices,
                                         long points) const {
    long stride = 1, offset = -1;
    each(primitives, {"input"}, [&](const XMLElement& e) {
      const long at = count(e, "offset", 0);
      stride = std::max(stride, at + 1);
      if (stride > 64) fail(e, "has an offset above 63");
      if (e.Attribute("semantic", "VERTEX") == nullptr) return;
      if (offset >= 0) fail(e, "gives vertices for the second time");
      if (reference(e, "source") != vertices) fail(e, "does not name the <vertices> of the mesh");
      offset = at;
    });
    if (offset < 0) fail(primitives, "has no <input> of semantic VERTEX");
    std::vector<std::vector<long>> runs;
    each(primitives, {"p"}, [&](const XMLElement& p) {
      const std::vector<long> indices = integers(p);
      const long size = static_cast<long>(indices.size());
      if (size % stride != 0) {
        fail(p, fmt::format("does not hold a multiple of {} indices", stride));
      }
      std::vector<long>& run = runs.emplace_back();
      for (long i = offset; i < size; i += stride) {
        if (indices[i] < 0 || indices[i] >= points) {
          fail(p, fmt::format("holds index {}, beyond the {} there are", indices[i], points));
        }
        run.push_back(indices[i]);  // cppcheck-suppress invalidContainerReference
      }
    });
    return runs;
  }

  /// Cuts a list of corners into polygons of the given sizes.
  void cut(const XMLElement& primitives, const std::vector<long>& run,
           const std::vector<long>& sizes, Polygons& out) const {
    const long end = static_cast<long>(run.size());
    long at = 0;
    for (const long size : sizes) {
      if (size < 1 || size > end - at) {
        fail(primitives, fmt::format("has a polygon of {} corners; it needs between 1 and the {} "
                                     "that are left in <p>",
                                     size, end - at));
      }
      out.add(&run[at], size);
      at += size;
    }
    const long polygons = static_cast<long>(sizes.size());
    if (at != end || count(primitives, "count", polygons) != polygons) {
      fail(primitives, "does not hold as many corners or polygons as it says");
    }
  }

  void write_polygons(const Polygons& polygons, const char* vertices) {
    open("polylist");
    out_.PushAttribute("count", polygons.count);
    write_input("VERTEX", vertices);
    open("vcount");
    out_.PushText(polygons.sizes.c_str());
    out_.CloseElement();
    open("p");
    out_.PushText(polygons.corners.c_str());
    out_.CloseElement();
    out_.CloseElement();
  }

  /// Writes a <node> or a <visual_scene>.
  void node(const XMLElement& node) {
    static const std::map<std::string, size_t> kTransforms = {
        {"matrix", 16}, {"translate", 3}, {"rotate", 4}, {"scale", 3}, {"lookat", 9}};
    open(node.Name());
    copy(node, "id");
    copy(node, "name");
    each(node, {}, [&](const XMLElement& e) {
      const auto transform = kTransforms.find(e.Name());
      if (transform != kTransforms.end()) {
        if (reals(e).size() != transform->second) {
          fail(e, fmt::format("needs {} numbers", transform->second));
        }
        open(e.Name());
        out_.PushText(text(e).c_str());
        out_.CloseElement();
      } else if (is_one_of(e, {"skew"})) {
        fail(e, "is not read; give a <matrix>");  // assimp aborts the program at it
      } else if (is_one_of(e, {"instance_controller"})) {
        fail(e, "places a skin, which is not read");
      } else if (is_one_of(e, {"instance_geometry", "instance_node"})) {
        const std::string name = reference(e, "url");
        if (is_one_of(e, {"instance_geometry"}) && geometries_.count(name) == 0) {
          fail(e, fmt::format("names geometry '{}', which is not in this file", name));
        }
        open(e.Name());
        copy(e, "url");
        out_.CloseElement();
      } else if (is_one_of(e, {"node"})) {
        this->node(e);
      }
    });
    out_.CloseElement();
  }

  void scene(const XMLElement& scene) {
    open("scene");
    if (const auto* e = only(scene, "instance_visual_scene")) {
      reference(*e, "url");
      open(e->Name());
      copy(*e, "url");
      out_.CloseElement();
    }
    out_.CloseElement();
  }

  tinyxml2::XMLPrinter out_{nullptr, true};
  std::set<std::string> geometries_;  // ids
};

}  // namespace

std::string plain_collada(const std::filesystem::path& file) { return PlainCollada(file).run(); }

}  // namespace counterpoint
