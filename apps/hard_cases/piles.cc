// Random piles: bodies of mixed shapes fall into a heap. Their motion is not known, but it must go
// on without failure, gain no energy, stay above the ground and come to rest.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "trial.h"

namespace counterpoint::apps {
namespace {

/// Durations [s]. Bodies with edges that lean on a ball move until it stops rolling: 11 s in
/// pile_64.
constexpr double kDuration = 10.0, kUntilRest = 15.0;

/// Largest motion in the last second [m]: contacts near their friction limit creep
/// (contact/README.md). At most 0.11 mm in 16 starts of pile_64.
constexpr double kCreeps = 2e-4;

struct Bounds {
  double energy = 0.0;  ///< energy that separating overlaps may add, relative to the energy at the
                        ///< start
  double depth = 1e-3;  ///< largest depth below the ground at the end [m]
  bool rests = true;    ///< boxes and hulls must be at rest in the last second
};

/// Depth of the lowest point of all bodies below z = 0 [m].
double depth_below_ground(const Runner& sim, const View& view) {
  double lowest = 0.0;
  const std::vector<Geometry>& geometries = sim.model().geometries();
  for (std::size_t i = 0; i < geometries.size(); ++i) {
    if (geometries[i].body == 0) continue;
    const Pose X_WG = view.geometry_pose(static_cast<int>(i));
    lowest = std::min(lowest, lowest_point(geometries[i].shape, X_WG));
  }
  return -lowest;
}

/// Largest displacement of a body with edges [m]; without rolling friction other bodies need not
/// come to rest.
double edges_moved(const Model& model, const VectorX& q, const VectorX& q_start) {
  double most = 0.0;
  for (const Geometry& g : model.geometries()) {
    if (g.body == 0 || (g.shape.type != ShapeType::kBox && g.shape.type != ShapeType::kConvexMesh))
      continue;
    const int at = model.body(g.body).q_index;
    most = std::max(most, (q.segment<3>(at) - q_start.segment<3>(at)).norm());
  }
  return most;
}

/// Quantities observed after every step.
class PileWatch {
 public:
  PileWatch(Trial& trial, Runner& sim)
      : trial_(trial), sim_(sim), view_(sim), start_(view_.energy()) {
    trial.plot("energy [J]", {{"start", start_}});
  }

  void after_step() {
    view_.look();
    const double now = view_.energy();
    gain_ = std::max(gain_, now - start_);
    finite_ = finite_ && std::isfinite(now) && sim_.state().q.allFinite();
    for (int i = 1; i < sim_.model().num_bodies(); ++i)
      lowest_ = std::min(lowest_, view_.center(i).z());
    if (++count_ % 10 == 0) trial_.draw(sim_, now);
  }

  void report(const Bounds& bounds) {
    trial_.at_most("values that are not finite", "1", finite_ ? 0.0 : 1.0, 0.0, "physics");
    trial_.at_most("highest energy over that of the start, less 1", "1", gain_ / start_,
                   bounds.energy + 1e-6,
                   bounds.energy > 0.0 ? "half overlapped, a heap is twice as high apart"
                                       : "nothing drives it");
    trial_.at_least("lowest centre of mass", "m", lowest_, 0.0, "the ground is solid");
    trial_.at_most("lowest point below the ground at the end", "m", depth_below_ground(sim_, view_),
                   bounds.depth, "a hundredth of the smallest body, by agreement");
  }

 private:
  Trial& trial_;
  Runner& sim_;
  View view_;
  double start_ = 0.0, gain_ = 0.0, lowest_ = std::numeric_limits<double>::infinity();  // J, J, m
  long count_ = 0;
  bool finite_ = true;
};

void pile(Trial& trial, const std::string& scene, const Bounds& bounds) {
  Runner& sim = trial.load(scene);
  PileWatch watch(trial, sim);
  trial.run(sim, (bounds.rests ? kUntilRest : kDuration) - 1.0,
            [&](const Runner&) { watch.after_step(); });
  const VectorX settled = sim.state().q;
  trial.run(sim, 1.0, [&](const Runner&) { watch.after_step(); });
  watch.report(bounds);
  if (!bounds.rests) return;
  trial.at_most("boxes and hulls move from 14 to 15 s", "m",
                edges_moved(sim.model(), sim.state().q, settled), kCreeps,
                "friction holds what has edges; by agreement");
}

HardCase pile_case(const std::string& name, const std::string& hard, const Bounds& bounds) {
  const std::string scene = "../piles/" + name;
  return {name, hard, [=](Trial& trial) { pile(trial, scene, bounds); }, false, scene};
}

}  // namespace

std::vector<HardCase> pile_cases() {
  return {
      pile_case("pile_16", "Boxes, balls, capsules, cylinders and hulls fall into a heap.", {}),
      pile_case("pile_64", "The same with 64 bodies: long ways for forces, and many solutions.",
                {}),
      pile_case("pile_16_masses", "A heap of a gram to a tonne, friction 2.",
                {.depth = 1e-2, .rests = false}),
      pile_case("pile_64_masses", "A heap of 0.1 g to 10 t, friction 2.",
                {.depth = 1e-2, .rests = false}),
      pile_case("pile_64_overlap", "64 bodies start up to half inside each other, friction 2.",
                {.energy = 1.0}),
      pile_case("bin_64", "64 bodies fall between four walls: some layers deep, walls carry load.",
                {}),
      pile_case("chain_into_pile", "A chain of 12 links is thrown at a heap at 6 m/s.",
                {.rests = false}),
  };
}

}  // namespace counterpoint::apps
