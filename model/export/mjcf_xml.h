// Elements of an exported MJCF file, and the names that parts of a model have in it.
#pragma once

#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <initializer_list>
#include <string>
#include <utility>

#include "counterpoint/model/export/numbers.h"
#include "counterpoint/model/model.h"

namespace counterpoint {

/// Writes elements one after the other.
class MjcfXml {
 public:
  void open(const char* name) { xml_.OpenElement(name); }
  void close() { xml_.CloseElement(); }
  void set(const char* name, const std::string& value) { xml_.PushAttribute(name, value.c_str()); }
  void set(const char* name, double value) { set(name, export_number(value)); }
  /// Writes an element without children.
  void element(const char* name,
               std::initializer_list<std::pair<const char*, std::string>> attributes) {
    open(name);
    for (const auto& [key, value] : attributes) set(key, value);
    close();
  }
  void site(const std::string& name, const Pose& X_BS) {
    element("site", {{"name", name},
                     {"pos", export_numbers(X_BS.translation)},
                     {"quat", export_quaternion(X_BS.rotation)}});
  }
  std::string text() const { return xml_.CStr(); }

 private:
  tinyxml2::XMLPrinter xml_;
};

/// Returns two finite limits: MJCF has both or none, and 1e9 stands for no limit.
inline std::string mjcf_range(double lower, double upper) {
  constexpr double kBeyond = 1e9;
  return export_numbers({std::max(lower, -kBeyond), std::min(upper, kBeyond)});
}

/// Whether MJCF has a free joint for this body.
inline bool is_free_in_mjcf(const Body& body) {
  return body.joint_type == JointType::kFloating && body.parent == 0;
}

inline std::string mjcf_body_name(const Model& model, int body) {
  return body == 0 ? "world" : model.joint(body - 1).link;
}

/// Returns the name of a joint, or of one of the joints that together stand for it.
inline std::string mjcf_joint_name(const Model& model, int joint, int part = 0) {
  const Body& body = model.body(joint + 1);
  const bool several = !is_free_in_mjcf(body) && (body.joint_type == JointType::kPlanar ||
                                                  body.joint_type == JointType::kFloating);
  return several ? fmt::format("{}/{}", model.joint(joint).name, part) : model.joint(joint).name;
}

}  // namespace counterpoint
