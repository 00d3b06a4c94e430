#include "report/closure_table.h"

#include <string>

namespace counterpoint::apps {
namespace {

Json axes_json(const Vector3& v) { return {v.x(), v.y(), v.z()}; }

}  // namespace

Json closure_json(const Closure& closure, const ClosureGap& gap) {
  Json out = {{"name", closure.name},
              {"type", closure_type_name(closure.type)},
              {"anchor_a_m", axes_json(closure.X_AC.translation)},
              {"anchor_b_m", axes_json(closure.X_BC.translation)},
              {"open_m", gap.distance},
              {"open_rad", gap.angle}};
  if (closure.type == ClosureType::kDistance) {
    out["length_m"] = closure.length;
    out["rope"] = closure.rope;
  }
  if (closure.type == ClosureType::kScrew) out["pitch_m"] = closure.pitch;
  if (closure.linear.acts) {
    out["stiffness_N_m"] = axes_json(closure.linear.stiffness);
    out["damping_N_s_m"] = axes_json(closure.linear.damping);
  }
  if (closure.angular.acts) {
    out["rotational_stiffness_N_m_rad"] = axes_json(closure.angular.stiffness);
    out["rotational_damping_N_m_s_rad"] = axes_json(closure.angular.damping);
  }
  return out;
}

}  // namespace counterpoint::apps
