#include "counterpoint/model/collada_check.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "counterpoint/model/limits.h"
#include "counterpoint/model/text_file.h"
#include "counterpoint/model/types.h"

namespace counterpoint {
namespace {

using tinyxml2::XMLElement;

class ColladaCheck {
 public:
  explicit ColladaCheck(const std::filesystem::path& file) : file_(file.string()) {}

  void run() {
    const std::string text = read_xml_file(file_, "there is no such mesh file");
    tinyxml2::XMLDocument document;
    if (document.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS) {
      throw InputError(fmt::format("{}:{}: not well-formed XML: {}", file_,
                                   std::max(1, document.ErrorLineNum()), document.ErrorName()));
    }
    if (document.RootElement() == nullptr) return;
    // Assimp looks for <COLLADA> beyond an element that stands before it.
    const XMLElement* second = document.RootElement()->NextSiblingElement();
    if (second != nullptr) fail(*second, "stands behind the end of the document's one element");
    walk(*document.RootElement());
    for (const XMLElement* node : roots_) extent(*node, 0);
  }

 private:
  [[noreturn]] void fail(const XMLElement& at, const std::string& what) const {
    throw InputError(fmt::format("{}:{}: <{}> {}; export the mesh anew", file_, at.GetLineNum(),
                                 at.Name(), what));
  }

  /// The text as numbers.
  template <typename Number, typename Parse>
  std::vector<Number> numbers(const XMLElement& in, const Parse& parse) const {
    std::vector<Number> out;
    const char* text = in.GetText() == nullptr ? "" : in.GetText();
    constexpr const char* kBlank = " \t\r\n";
    for (text += std::strspn(text, kBlank); *text != '\0'; text += std::strspn(text, kBlank)) {
      char* end = nullptr;
      errno = 0;
      out.push_back(parse(text, &end));
      if (end == text || std::strchr(kBlank, *end) == nullptr) {
        fail(in, fmt::format("holds '{:.16}' where a number is expected", text));
      }
      text = end;
    }
    return out;
  }
  std::vector<double> reals(const XMLElement& in) const {
    return numbers<double>(in, [](const char* s, char** end) { return std::strtod(s, end); });
  }
  std::vector<long> integers(const XMLElement& in) const {
    return numbers<long>(in, [](const char* s, char** end) { return std::strtol(s, end, 10); });
  }

  /// An attribute that counts; `otherwise` if it is not there.
  long count(const XMLElement& in, const char* name, long otherwise) const {
    const char* text = in.Attribute(name);
    if (text == nullptr) return otherwise;
    char* end = nullptr;
    const long value = std::strtol(text, &end, 10);
    if (end == text || *end != '\0' || value < 0 || value > 1'000'000'000) {
      fail(in, fmt::format("has {}=\"{:.16}\", which is no count", name, text));
    }
    return value;
  }

  void walk(const XMLElement& element) {
    const std::map<std::string, size_t> kTransforms = {
        {"matrix", 16}, {"translate", 3}, {"rotate", 4}, {"scale", 3}, {"lookat", 9}, {"skew", 7}};
    const auto transform = kTransforms.find(element.Name());
    if (transform != kTransforms.end() && reals(element).size() != transform->second) {
      fail(element, fmt::format("needs {} numbers", transform->second));
    }
    const std::string kind = element.Name();
    if (kind == "mesh") check_mesh(element);
    if (kind == "node" || kind == "visual_scene") keep_node(element);
    for (const auto* e = element.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      walk(*e);
    }
  }

  void keep_node(const XMLElement& node) {
    const XMLElement* parent = node.Parent() == nullptr ? nullptr : node.Parent()->ToElement();
    if (parent == nullptr || std::strcmp(parent->Name(), "node") != 0) roots_.push_back(&node);
    // A node without an id or a name is the one that url="#" means; a scene's name is then "Scene".
    const bool scene = std::strcmp(node.Name(), "visual_scene") == 0;
    const auto keep = [&](const char* key, const char* otherwise) {
      const char* text = node.Attribute(key);
      nodes_[text == nullptr ? otherwise : text].insert(&node);
    };
    keep("id", "");
    keep("name", scene ? "Scene" : "");
  }

  /// Number of nodes that come of this one, those of instances counted wherever they stand. Nodes
  /// that instance nodes that instance nodes multiply, or never end.
  size_t extent(const XMLElement& node, int depth) {
    if (depth > limits::kMaxMeshDepth) {
      fail(node,
           fmt::format("stands deeper than {} nodes, or within itself", limits::kMaxMeshDepth));
    }
    const auto known = extents_.find(&node);
    // Counted before, at another depth: near the limit the walk is made again.
    if (known != extents_.end() && depth + known->second.depth <= limits::kMaxMeshDepth) {
      deepest_ = std::max(deepest_, depth + known->second.depth);
      return known->second.nodes;
    }
    const int outer = std::exchange(deepest_, depth);
    size_t nodes = 1;
    for (const auto* e = node.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      if (std::strcmp(e->Name(), "node") == 0) nodes += extent(*e, depth + 1);
      if (std::strcmp(e->Name(), "instance_node") == 0) nodes += instance_extent(*e, depth + 1);
      if (nodes > limits::kMaxMeshNodes) {
        fail(node, fmt::format("comes to more than {} nodes", limits::kMaxMeshNodes));
      }
    }
    extents_[&node] = {nodes, deepest_ - depth};
    deepest_ = std::max(deepest_, outer);
    return nodes;
  }

  size_t instance_extent(const XMLElement& instance, int depth) {
    const char* url = instance.Attribute("url");
    const auto named = url == nullptr || *url != '#' ? nodes_.end() : nodes_.find(url + 1);
    if (named == nodes_.end()) return 0;  // assimp leaves it out
    size_t nodes = 0;  // which of several of one name is meant assimp knows; here the sum is safe
    for (const XMLElement* node : named->second) nodes += extent(*node, depth);
    return nodes;
  }

  void check_mesh(const XMLElement& mesh) {
    lengths_.clear();
    for (const auto* e = mesh.FirstChildElement("source"); e; e = e->NextSiblingElement("source")) {
      read_source(*e);
    }
    const auto* vertices = mesh.FirstChildElement("vertices");
    if (vertices != nullptr) {
      long least = 1'000'000'000;
      for (const auto* e = vertices->FirstChildElement("input"); e;
           e = e->NextSiblingElement("input")) {
        least = std::min(least, length(*e));
      }
      const char* id = vertices->Attribute("id");
      if (id != nullptr) lengths_[id] = least;
    }
    for (const auto* e = mesh.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      if (e->FirstChildElement("p") != nullptr) check_primitives(*e);
    }
  }

  void read_source(const XMLElement& source) {
    const auto* array = source.FirstChildElement("float_array");
    if (array == nullptr) return;  // names and the like
    const long size = static_cast<long>(reals(*array).size());
    if (count(*array, "count", -1) != size) {
      fail(*array, "does not hold as many numbers as it says");
    }
    const auto* common = source.FirstChildElement("technique_common");
    const auto* accessor = common == nullptr ? nullptr : common->FirstChildElement("accessor");
    const char* id = source.Attribute("id");
    if (accessor == nullptr || id == nullptr) fail(source, "has no id or no accessor");
    const char* array_id = array->Attribute("id");
    const char* named = accessor->Attribute("source");
    if (array_id == nullptr || named == nullptr || *named != '#' ||
        std::strcmp(named + 1, array_id) != 0) {
      fail(*accessor, "does not name the array beside it");
    }
    const long elements = count(*accessor, "count", 0);
    const long stride = count(*accessor, "stride", 1);
    long width = 0;  // numbers of one element that may be read
    for (const auto* e = accessor->FirstChildElement("param"); e;
         e = e->NextSiblingElement("param")) {
      ++width;
    }
    if (elements > 0 &&
        count(*accessor, "offset", 0) + (elements - 1) * stride + std::max(stride, width) > size) {
      fail(*accessor, "reaches beyond its array");
    }
    lengths_[id] = elements;
  }

  /// Number of elements of the source that an <input> names.
  long length(const XMLElement& input) const {
    const char* name = input.Attribute("source");
    const auto found = name == nullptr || *name != '#' ? lengths_.end() : lengths_.find(name + 1);
    if (found == lengths_.end()) {
      fail(input,
           fmt::format("names source '{}', which is not there", name == nullptr ? "" : name));
    }
    return found->second;
  }

  /// Assimp takes inputs, sizes and indices in the order in which they stand, at any depth.
  void check_order(const XMLElement& primitives) const {
    bool indices = false;
    for (const auto* e = primitives.FirstChildElement(); e; e = e->NextSiblingElement()) {
      if (e->FirstChildElement() != nullptr) fail(*e, "holds elements, here where none may stand");
      if (std::strcmp(e->Name(), "p") == 0) {
        indices = true;
      } else if (indices && std::strcmp(e->Name(), "extra") != 0) {
        fail(*e, "stands behind the indices <p> that it is for");
      }
    }
  }

  void check_primitives(const XMLElement& primitives) {
    check_order(primitives);
    std::vector<std::pair<long, long>> inputs;  // offset, length of the source
    long stride = 1;
    bool vertex = false;
    for (const auto* e = primitives.FirstChildElement("input"); e;
         e = e->NextSiblingElement("input")) {
      inputs.emplace_back(count(*e, "offset", 0), length(*e));
      vertex |= e->Attribute("semantic", "VERTEX") != nullptr;
      stride = std::max(stride, inputs.back().first + 1);
      if (stride > 64) fail(*e, "has an offset above 63");
    }
    if (!vertex) fail(primitives, "has no <input> of semantic VERTEX");
    long corners = 0;
    for (const auto* p = primitives.FirstChildElement("p"); p; p = p->NextSiblingElement("p")) {
      const std::vector<long> indices = integers(*p);
      const long size = static_cast<long>(indices.size());
      if (size % stride != 0)
        fail(*p, fmt::format("does not hold a multiple of {} indices", stride));
      corners += size / stride;
      for (const auto& [offset, end] : inputs) {
        for (long i = offset; i < size; i += stride) {
          if (indices[i] < 0 || indices[i] >= end) {
            fail(*p, fmt::format("holds index {}, beyond the {} there are", indices[i], end));
          }
        }
      }
    }
    const std::string kind = primitives.Name();
    const auto* vcount = primitives.FirstChildElement("vcount");
    long expected = kind == "triangles" ? 3 * count(primitives, "count", corners / 3) : corners;
    if (vcount == nullptr && kind == "polylist") fail(primitives, "has no <vcount>");
    if (vcount != nullptr) {
      expected = 0;
      const std::vector<long> sizes = integers(*vcount);
      for (const long size : sizes) {
        if (size < 1 || size > corners) fail(*vcount, "holds a size that no polygon here has");
        expected += size;
      }
      if (count(primitives, "count", -1) != static_cast<long>(sizes.size())) {
        fail(primitives, "does not hold as many polygons as it says");
      }
    }
    if (expected != corners) fail(primitives, "does not hold as many corners as it says");
  }

  const std::string file_;
  std::map<std::string, long> lengths_;  // elements of sources and vertices, by id
  struct Extent {
    size_t nodes;
    int depth;
  };
  std::vector<const XMLElement*> roots_;                      // nodes that stand in no node
  std::map<std::string, std::set<const XMLElement*>> nodes_;  // by id and by name
  std::map<const XMLElement*, Extent> extents_;
  int deepest_ = 0;  // reached since the node that is being counted
};

}  // namespace

void check_collada(const std::filesystem::path& file) { ColladaCheck(file).run(); }

}  // namespace counterpoint
