#include "counterpoint/model/mesh/collada_nodes.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "counterpoint/model/limits.h"

namespace counterpoint {
namespace {

using tinyxml2::XMLElement;

class Nodes {
 public:
  Nodes(const XMLElement& collada, const ColladaReader& reader) : reader_(reader) {
    keep(collada);
    for (const XMLElement* root : roots_) extent(*root, 0);
  }

 private:
  void keep(const XMLElement& above) {
    for (const auto* e = above.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      const bool scene = ColladaReader::is_one_of(*e, {"visual_scene"});
      if (scene || ColladaReader::is_one_of(*e, {"node"})) {
        if (!ColladaReader::is_one_of(above, {"node"})) roots_.push_back(e);
        // In assimp url="#" names nodes without an id or a name, and a scene without a name is
        // "Scene".
        keep_as(*e, "id", "");
        keep_as(*e, "name", scene ? "Scene" : "");
      }
      keep(*e);
    }
  }

  void keep_as(const XMLElement& node, const char* key, const char* otherwise) {
    const char* text = node.Attribute(key);
    nodes_[text == nullptr ? otherwise : text].insert(&node);
  }

  /// Number of nodes that this one expands to. Instances of nodes with instances multiply; cyclic
  /// ones never end.
  size_t extent(const XMLElement& node, int depth) {
    if (depth > limits::kMaxMeshDepth) {
      reader_.fail(node, fmt::format("stands deeper than {} nodes, or within itself",
                                     limits::kMaxMeshDepth));
    }
    const auto known = extents_.find(&node);
    // Counted before at another depth: near the depth limit the count is repeated.
    if (known != extents_.end() && depth + known->second.depth <= limits::kMaxMeshDepth) {
      deepest_ = std::max(deepest_, depth + known->second.depth);
      return known->second.nodes;
    }
    const int outer = std::exchange(deepest_, depth);
    size_t nodes = 1;
    for (const auto* e = node.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      if (ColladaReader::is_one_of(*e, {"node"})) nodes += extent(*e, depth + 1);
      if (ColladaReader::is_one_of(*e, {"instance_node"})) nodes += instance_extent(*e, depth + 1);
      if (nodes > limits::kMaxMeshNodes) {
        reader_.fail(node, fmt::format("comes to more than {} nodes", limits::kMaxMeshNodes));
      }
    }
    extents_[&node] = {nodes, deepest_ - depth};
    deepest_ = std::max(deepest_, outer);
    return nodes;
  }

  size_t instance_extent(const XMLElement& instance, int depth) {
    const std::string name = reader_.reference(instance, "url");
    const auto named = nodes_.find(name);
    if (named == nodes_.end()) {
      reader_.fail(instance, fmt::format("names node '#{}', which is not in this file", name));
    }
    size_t nodes = 0;  // assimp chooses one node if several share the name; the sum is safe
    for (const XMLElement* node : named->second) nodes += extent(*node, depth);
    return nodes;
  }

  struct Extent {
    size_t nodes;
    int depth;
  };
  const ColladaReader& reader_;
  std::vector<const XMLElement*> roots_;                      // nodes within no other node
  std::map<std::string, std::set<const XMLElement*>> nodes_;  // keys: ids and names
  std::map<const XMLElement*, Extent> extents_;
  int deepest_ = 0;  // largest depth reached since the current node was entered
};

}  // namespace

void check_collada_nodes(const XMLElement& collada, const ColladaReader& reader) {
  Nodes(collada, reader);
}

}  // namespace counterpoint
