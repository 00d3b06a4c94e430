#include "counterpoint/model/builder/tendon_path.h"

#include <fmt/format.h>

#include "counterpoint/model/builder/builder_names.h"

namespace counterpoint {
namespace {

using Place = TendonSpec::Place;

/// Turns the places of a path into segments.
class PathMaker {
 public:
  PathMaker(const TendonSpec& spec, Tendon& tendon) : spec_(spec), tendon_(tendon) {}

  void add(const Place& place, int body, const Pose& X_BL) {
    switch (place.kind) {
      case Place::Kind::kPulley:
        end_branch();
        share_ = 1.0 / place.divisor;
        return;
      case Place::Kind::kPoint: {
        const TendonPoint point{body, (X_BL * place.X_LG).translation};
        if (last_) tendon_.path.push_back({*last_, point, wrap_, share_});
        ++points_;
        last_ = point;
        wrap_ = -1;
        return;
      }
      default:
        if (!last_ || wrap_ >= 0)
          fail_tendon(spec_, "a sphere or cylinder must stand between two points");
        wrap_ = static_cast<int>(tendon_.wraps.size());
        tendon_.wraps.push_back({body, X_BL * place.X_LG, place.radius,
                                 place.kind == Place::Kind::kCylinder, place.side});
    }
  }
  void end_branch() {
    const bool none_yet = tendon_.path.empty() && points_ == 0;
    if (wrap_ >= 0) fail_tendon(spec_, "a sphere or cylinder must stand between two points");
    if (points_ < 2 && !none_yet) fail_tendon(spec_, "a path needs at least two points");
    points_ = 0;
    last_.reset();
  }

 private:
  const TendonSpec& spec_;
  Tendon& tendon_;
  std::optional<TendonPoint> last_;
  int wrap_ = -1, points_ = 0;
  double share_ = 1.0;
};

}  // namespace

void fail_tendon(const TendonSpec& spec, const std::string& what) {
  throw InputError(located_at(spec.where, fmt::format("tendon '{}': {}", spec.name, what)));
}

void make_tendon_path(const TendonSpec& spec, const FindLink& find, Tendon& tendon) {
  if (spec.path.empty()) return;
  PathMaker maker(spec, tendon);
  for (const Place& place : spec.path) {
    const bool pulley = place.kind == Place::Kind::kPulley;
    const auto [body, X_BL] = pulley ? std::pair(0, Pose()) : find(place.link);
    maker.add(place, body, X_BL);
  }
  maker.end_branch();
}

}  // namespace counterpoint
