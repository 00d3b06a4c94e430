#include "counterpoint/model/robot_files.h"

namespace counterpoint {

void add_parts(const ModelParts& parts, const Pose& X_WL, const std::string& prefix,
               ModelBuilder& builder) {
  for (const ModelParts::Environment& e : parts.environment)
    builder.add_environment(prefix + e.name, e.shape, X_WL * e.X_WG, e.material);
  for (const ModelParts::Exclusion& e : parts.exclusions)
    builder.exclude_pair(prefix + e.a, prefix + e.b, e.reason);
  for (const auto& [a, b] : parts.inclusions) builder.include_pair(prefix + a, prefix + b);
  for (const ModelParts::Surface& s : parts.surfaces)
    builder.set_pair_surface(prefix + s.a, prefix + s.b, s.surface);
  for (ClosureSpec closure : parts.closures) {
    closure.name = prefix + closure.name;
    closure.link_a = prefix + closure.link_a;
    closure.link_b = prefix + closure.link_b;
    builder.add_closure(closure);
  }
}

}  // namespace counterpoint
