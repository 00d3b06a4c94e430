#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/optimize/control.h"
#include "counterpoint/engine/optimize/files/pose_reader.h"
#include "counterpoint/engine/trajectory.h"

namespace counterpoint::optimization {
namespace {

/// Default gains of a robot on a floating base, as shares of a joint's effort limit E: stiffness
/// kStiffness E [1/rad], damping kDamping E [s/rad].
constexpr double kStiffness = 2.0, kDamping = 0.08;
/// Default natural frequency of the joints of a robot on a fixed base [rad/s], critically damped.
constexpr double kFrequency = 20.0;

FeedbackGains default_gains(const Problem& problem) {
  const Model& model = *problem.model;
  FeedbackGains gains{VectorX::Zero(model.nv()), VectorX::Zero(model.nv())};
  Dynamics dynamics(model);
  dynamics.set_configuration(problem.start_q);
  MatrixX M(model.nv(), model.nv());
  dynamics.mass_matrix(M);
  M.diagonal() += model.armature();
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    const Tree& tree = model.trees()[static_cast<std::size_t>(body.tree)];
    const bool floats = model.body(tree.body_begin).joint_type == JointType::kFloating;
    const double limit = model.joint(i - 1).effort_limit;
    for (int k = body.v_index; k < body.v_index + joint_nv(body.joint_type); ++k) {
      if (!problem.motors[static_cast<std::size_t>(k)]) continue;
      const bool by_limit = floats && std::isfinite(limit);
      gains.stiffness[k] = by_limit ? kStiffness * limit : kFrequency * kFrequency * M(k, k);
      gains.damping[k] = by_limit ? kDamping * limit : 2.0 * kFrequency * M(k, k);
    }
  }
  return gains;
}

class ControlReader {
 public:
  explicit ControlReader(const std::filesystem::path& file) : root_(YamlValue::load(file)) {
    out_.file = load_problem(file);
  }

  ControlFile read() {
    const Problem& problem = out_.file.problem;
    out_.gains = default_gains(problem);
    if (!root_.has("control")) root_.fail("the key 'control' is missing; see `optimize` for plans");
    const YamlValue in = root_.at("control");
    in.expect_map({"smoothing", "compliance_per_metre", "margin_per_smoothing", "penalty",
                   "iterations", "first_iterations", "least_damping", "lost_above",
                   "disturbance_time", "contact_damping", "replan_interval", "world_step",
                   "duration", "feedback", "perturbation", "pushes", "success", "world"});
    read_world(in);
    read_planner(in);
    read_positive(in, "replan_interval", out_.interval);
    read_positive(in, "world_step", out_.plant_step);
    read_positive(in, "duration", out_.duration);
    if (in.has("feedback")) read_feedback(in.at("feedback"));
    if (in.has("perturbation")) read_perturbation(in.at("perturbation"));
    if (in.has("pushes"))
      for (const YamlValue& push : in.at("pushes").list()) out_.pushes.push_back(read_push(push));
    for (const YamlValue& test : in.at("success").list()) out_.success.push_back(read_test(test));
    return std::move(out_);
  }

 private:
  const Model& model() const { return *out_.file.problem.model; }

  void read_world(const YamlValue& in) {
    out_.world = out_.file.scene;
    if (!in.has("world")) return;
    use_world(out_, out_.file.file.parent_path() / in.at("world").text());
  }

  void read_planner(const YamlValue& in) {
    PlannerSettings& planner = out_.planner;
    read_positive(in, "smoothing", planner.smoothing);
    read_positive(in, "compliance_per_metre", planner.compliance_per_metre);
    read_positive(in, "margin_per_smoothing", planner.margin_per_smoothing);
    read_positive(in, "penalty", planner.penalty);
    read_positive(in, "least_damping", planner.least_damping);
    read_positive(in, "lost_above", planner.lost_above);
    read_positive(in, "contact_damping", planner.contact_damping);
    read_positive(in, "disturbance_time", planner.disturbance_time);
    if (in.has("iterations")) planner.iterations = in.at("iterations").integer(1, 1000);
    if (in.has("first_iterations"))
      planner.first_iterations = in.at("first_iterations").integer(1, 100'000);
  }

  void read_feedback(const YamlValue& in) {
    in.expect_map({"stiffness", "damping"});
    if (in.has("stiffness")) read_by_velocity(in.at("stiffness"), model(), out_.gains.stiffness);
    if (in.has("damping")) read_by_velocity(in.at("damping"), model(), out_.gains.damping);
  }

  void read_perturbation(const YamlValue& in) {
    in.expect_map({"position", "velocity", "base_velocity", "coordinates"});
    Perturbation& p = out_.perturbation;
    if (in.has("position")) p.position = in.at("position").number(0.0, 10.0);
    if (in.has("velocity")) p.velocity = in.at("velocity").number(0.0, 100.0);
    if (in.has("base_velocity")) p.base_velocity = in.at("base_velocity").number(0.0, 100.0);
    if (!in.has("coordinates")) return;
    p.extra.setZero(model().nv());
    read_by_velocity(in.at("coordinates"), model(), p.extra);
  }

  Push read_push(const YamlValue& in) const {
    in.expect_map({"link", "force", "start", "duration"});
    Push push;
    const YamlValue link = in.at("link");
    try {
      push.link = pushed_link(out_.world->model, link.text());
    } catch (const InputError& error) {
      link.fail(error.what());
    }
    push.force = in.at("force").vector3();
    push.start = in.at("start").number(0.0, 1e9);
    if (in.has("duration")) push.duration = in.at("duration").positive();
    return push;
  }

  SuccessTest read_test(const YamlValue& in) const {
    in.expect_map({"coordinate", "rate", "within", "above", "below", "always", "from"});
    if (in.has("coordinate") == in.has("rate"))
      in.fail("either 'coordinate' (its value) or 'rate' (its mean change per second) is expected");
    SuccessTest test;
    test.rate = in.has("rate");
    const YamlValue name = in.at(test.rate ? "rate" : "coordinate");
    test.name = name.text();
    const CoordinateNames names = coordinate_names(model());
    const auto found = std::find_if(names.q.begin(), names.q.end(), [&](const std::string& known) {
      return known == test.name || known == test.name + ".q";
    });
    if (found == names.q.end())
      name.fail(fmt::format("'{}' is no coordinate of the scene; known: {}", test.name,
                            fmt::join(names.q, ", ")));
    test.q_index = static_cast<int>(found - names.q.begin());
    if (in.has("within")) {
      const std::vector<double> range = in.at("within").numbers();
      if (range.size() != 2 || !(range[0] < range[1]))
        in.at("within").fail("two numbers, low < high, are expected");
      test.low = range[0];
      test.high = range[1];
    }
    if (in.has("above")) test.low = in.at("above").number();
    if (in.has("below")) test.high = in.at("below").number();
    if (!(std::isfinite(test.low) || std::isfinite(test.high)))
      in.fail("'within', 'above' or 'below' is missing");
    if (in.has("always")) test.always = in.at("always").boolean();
    if (in.has("from")) test.from = in.at("from").number(0.0, 1e9);
    return test;
  }

  const YamlValue root_;
  ControlFile out_;
};

}  // namespace

int pushed_link(const Model& model, const std::string& name) {
  const int link = frame_index(model, name);
  if (model.frames()[static_cast<std::size_t>(link)].body == 0)
    throw InputError(fmt::format("\"{}\" is fixed to the world, and cannot be pushed", name));
  return link;
}

void use_world(ControlFile& control, const std::filesystem::path& scene) {
  control.world = std::make_shared<const Scene>(load_scene(scene));
  if (coordinate_names(control.world->model).q != coordinate_names(*control.file.problem.model).q)
    throw InputError(
        fmt::format("{}: the world's coordinates differ from those of the plan's scene {}: name "
                    "the same robots in the same order",
                    scene.string(), control.file.scene_file.string()));
}

InputColumns input_columns(const ControlFile& control) {
  std::set<int> links;
  for (const Push& push : control.pushes) links.insert(push.link);
  const Scene& world = *control.world;
  const bool servos = world.options.effects.has(Effect::kServos) && !world.model.servos().empty();
  return {servos, {links.begin(), links.end()}};
}

ControlFile load_control(const std::filesystem::path& file) { return ControlReader(file).read(); }

}  // namespace counterpoint::optimization
