// The block test applied to every regularized engine: creep on a slope, hover while sliding, height
// at rest.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "counterpoint/model/model_builder.h"
#include "physics.h"

namespace counterpoint::apps::accuracy {
namespace {

constexpr double kGravity = 9.81, kHalf = 0.1, kFriction = 0.5, kSlope = 0.4;
constexpr double kSettle = 0.5, kWatch = 0.5;  // [s]
constexpr double kSpeed = 2.0;                 // [m/s], stops after 0.41 s

/// The block on the plane z = 0; gravity is tilted so that the plane has slope `slope` (tangent).
Scene block_on_plane(double slope) {
  Material material;
  material.friction = kFriction;
  Shape shape, plane;
  shape.type = ShapeType::kBox;
  shape.size = Vector3::Constant(kHalf);
  plane.type = ShapeType::kPlane;
  LinkSpec link;
  link.name = "block";
  const double moment = 4.0 * kHalf * kHalf / 6.0;  // cube of 1 kg [kg m^2]
  link.inertia = {1.0, Vector3::Zero(), Vector3::Constant(moment).asDiagonal()};
  link.collisions.push_back({"", Pose(), shape, material});
  RobotSpec robot;
  robot.name = "block";
  robot.links.push_back(link);
  ModelBuilder builder(kGravity * Vector3(slope, 0.0, -1.0).normalized());
  Pose X_WL;
  X_WL.translation.z() = kHalf;
  builder.add_robot(robot, Base::kFloating, X_WL);
  builder.add_environment("ground", plane, Pose(), material);
  Scene scene{"block", builder.build(), {}, {}, {}};
  scene.q = scene.model.default_q();
  scene.v = VectorX::Zero(scene.model.nv());
  return scene;
}

/// Steps for `seconds`, rounded to whole steps, and calls see(state) after each. False if a step
/// fails.
template <class See>
bool run(const Scene& scene, const EngineSetting& setting, double seconds, State& state, See see) {
  Workspace workspace(scene.model);
  State next;
  const double h = setting.options.time_step;
  for (double t = 0.0; t < seconds - 0.5 * h; t += h) {
    if (!step_forward(scene.model, setting.options, setting.solver, state, Input(), workspace, next)
             .succeeded())
      return false;
    std::swap(state, next);
    see(state);
  }
  return true;
}

}  // namespace

std::optional<BlockMetrics> measure_block(const EngineSetting& wanted) {
  EngineSetting setting = wanted;
  setting.options.effects = kDefaultEffects;
  BlockMetrics out;
  const auto nothing = [](const State&) {};

  const Scene slope = block_on_plane(kSlope), level = block_on_plane(0.0);
  State state{0.0, slope.q, slope.v};
  if (!run(slope, setting, kSettle, state, nothing)) return {};
  const State settled = state;
  if (!run(slope, setting, kWatch, state, nothing)) return {};
  out.creep = (state.q.head<3>() - settled.q.head<3>()).norm() / (state.time - settled.time);

  state = {0.0, level.q, level.v};
  state.v[0] = kSpeed;
  out.hover = -std::numeric_limits<double>::infinity();
  const auto height = [&](const State& s) { out.hover = std::max(out.hover, s.q[2] - kHalf); };
  if (!run(level, setting, kSettle, state, height)) return {};

  state = {0.0, level.q, level.v};
  if (!run(level, setting, kSettle, state, nothing)) return {};
  out.rest = state.q[2] - kHalf;
  return out;
}

}  // namespace counterpoint::apps::accuracy
