#include "counterpoint/engine/optimize/files/term_reader.h"

#include <fmt/format.h>

#include "counterpoint/engine/dynamics.h"
#include "counterpoint/engine/optimize/files/pose_reader.h"
#include "counterpoint/engine/optimize/optimize.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint::optimization {
namespace {

/// True for an entry whose targets change over time, as a table or a motion says.
bool follows(const YamlValue& in) {
  return in.has("target") &&
         (TargetReader::is_from_file(in.at("target")) || SourceMotion::is_target(in.at("target")));
}

const SourceMotion& motion_of(const YamlValue& in, const TargetSources& sources) {
  if (!sources.motion) in.fail("there is no motion to follow: the file has no key 'retarget'");
  return *sources.motion;
}

std::shared_ptr<const Reference> read_reference(const YamlValue& target, const Problem& problem,
                                                const Term& term, const VectorX& start,
                                                const Matrix3& link, TargetSources& sources) {
  if (!SourceMotion::is_target(target))
    return sources.tables.read(target, *problem.model, term, start, link);
  if (term.quantity != Quantity::kConfiguration)
    target.fail("'source' is the target of a configuration; points are followed by 'sources'");
  return motion_of(target, sources).configuration(target);
}

FrameRange read_frames(const YamlValue& in, int steps) {
  if (in.is_text("last")) return {-1, -1};
  if (in.is_text("all")) return {};
  const auto frame = [&](double value) {
    if (value != static_cast<int>(value) || std::abs(value) > steps + 1)
      in.fail(fmt::format("{} is no frame of 0 ... {}", value, steps));
    return static_cast<int>(value);
  };
  const std::vector<double> numbers = in.numbers();
  if (numbers.size() > 2) in.fail("'last', a frame, or [first, last] is expected");
  return {frame(numbers.front()), frame(numbers.back())};
}

/// Divides the weights (nv) by the value of `over`.
void scale_weights(const YamlValue& in, const Model& model, VectorX& weight) {
  if (!in.has("over")) return;
  const YamlValue over = in.at("over");
  if (!over.is_text("effort_limit")) {
    weight /= over.positive();
    return;
  }
  for (int i = 1; i < model.num_bodies(); ++i) {
    const Body& body = model.body(i);
    const double limit = model.joint(i - 1).effort_limit;
    for (int k = body.v_index; k < body.v_index + joint_nv(body.joint_type); ++k) {
      if (weight[k] == 0.0) continue;
      if (!std::isfinite(limit) || !(limit > 0.0))
        over.fail(fmt::format("joint '{}' has no effort limit; give `over` a number",
                              model.joint(i - 1).name));
      weight[k] /= limit;
    }
  }
}

void read_coordinate_weights(const YamlValue& in, const Model& model,
                             const std::vector<char>& motors, Term& term) {
  term.weight.setZero(model.nv());
  if (in.has("weight")) {
    read_by_velocity(in.at("weight"), model, term.weight);
  } else if (term.quantity == Quantity::kUnactuatedForce) {
    term.weight =
        unactuated_weights(model, motors, in.has("lever") ? in.at("lever").positive() : 0.5);
  } else {
    term.weight.setOnes();
  }
  // Forces without a motor are not effort; kUnactuatedForce makes them vanish.
  if (term.quantity == Quantity::kAppliedForce || term.quantity == Quantity::kEffortLimits)
    for (Eigen::Index i = 0; i < model.nv(); ++i)
      if (!motors[static_cast<std::size_t>(i)]) term.weight[i] = 0.0;
  scale_weights(in, model, term.weight);
}

void read_coordinate_target(const YamlValue& in, const Model& model, const VectorX& start,
                            const VectorX& goal, Term& term) {
  if (in.has("ahead")) {
    const YamlValue ahead = in.at("ahead");
    if (term.quantity != Quantity::kConfiguration || in.has("target"))
      ahead.fail("'ahead' is the target of a configuration, counted from the start");
    term.offset.setZero(model.nv());
    read_by_velocity(ahead, model, term.offset);
    term.target = start;
    integrate_configuration(model, start, term.offset, 1.0, term.target);
  } else if (term.quantity == Quantity::kConfiguration) {
    term.target = start;
    if (!in.has("target") || in.at("target").is_text("start") || follows(in)) return;
    const YamlValue target = in.at("target");
    if (follows_fit(in)) return;
    if (target.is_text("goal")) {
      if (goal.size() == 0) target.fail("there is no goal in this file");
      term.target = goal;
      return;
    }
    if (!target.is_map()) target.fail("start, goal, or a map {coordinate: value} is expected");
    read_pose(target, model, term.target);
  } else if (in.has("target") && !follows(in)) {
    term.target.setZero(model.nv());
    read_by_velocity(in.at("target"), model, term.target);
  }
}

void read_vector(const YamlValue& in, const char* key, Eigen::Index rows, double otherwise,
                 VectorX& out) {
  out.setConstant(rows, otherwise);
  if (!in.has(key)) return;
  const std::vector<double> numbers = in.at(key).numbers();
  if (numbers.size() != 1 && static_cast<Eigen::Index>(numbers.size()) != rows)
    in.at(key).fail(fmt::format("a number, or {} are expected", rows));
  for (Eigen::Index i = 0; i < rows; ++i)
    out[i] = numbers[numbers.size() == 1 ? 0 : static_cast<std::size_t>(i)];
}

std::vector<std::string> read_links(const YamlValue& in) {
  if (in.has("link")) return {in.at("link").text()};
  std::vector<std::string> links;
  if (in.has("links"))
    for (const YamlValue& link : in.at("links").list()) links.push_back(link.text());
  return links;
}

/// Returns one term for each link and point.
std::vector<Term> read_body_terms(const YamlValue& in, const Model& model, const Term& common) {
  std::vector<Vector3> points;
  if (in.has("point")) points.push_back(in.at("point").vector3());
  if (in.has("points"))
    for (const YamlValue& point : in.at("points").list()) points.push_back(point.vector3());
  if (points.empty()) points.push_back(Vector3::Zero());
  const std::vector<std::string> links = read_links(in);
  const bool of_all =
      common.quantity == Quantity::kCenterOfMass || common.quantity == Quantity::kMomentum ||
      common.quantity == Quantity::kAngularMomentum || common.quantity == Quantity::kDuration;
  if (links.empty()) {
    if (!of_all) in.fail("'link' or 'links' is missing: what is the term about?");
    return {common};
  }
  std::vector<Term> terms;
  for (const std::string& link : links) {
    const int frame = model.find_frame(link);
    if (frame < 0) in.fail(fmt::format("the scene has no link '{}'", link));
    const Frame& at = model.frames()[static_cast<std::size_t>(frame)];
    for (const Vector3& point : points) {
      Term term = common;
      term.body = at.body;
      term.point = at.X_BF * point;
      term.axis = at.X_BF.rotation * common.axis;
      term.orientation = common.orientation * at.X_BF.rotation.transpose();
      terms.push_back(term);
    }
  }
  return terms;
}

void check_duration(const YamlValue& in, const Problem& problem) {
  if (!problem.duration)
    in.at("quantity")
        .fail("the duration is fixed; give its range, as duration: [0.5, 2] beside 'steps'");
  for (const char* key :
       {"link", "links", "point", "points", "radius", "axis", "rpy", "frames", "when"})
    if (in.has(key)) in.at(key).fail("a duration is of the whole motion");
}

/// Returns the terms of an entry with `sources`.
std::vector<Term> read_source_terms(const YamlValue& in, const Term& common,
                                    const TargetSources& sources) {
  for (const char* key : {"link", "links", "point", "points", "target", "rpy"})
    if (in.has(key)) in.at(key).fail("links, points and targets of 'sources' are in their map");
  const YamlValue names = in.at("sources");
  return motion_of(names, sources).terms(names, common);
}

}  // namespace

std::vector<Term> read_terms(const YamlValue& in, const Problem& problem, const VectorX& start,
                             const VectorX& goal, TargetSources& sources) {
  const Model& model = *problem.model;
  in.expect_map({"quantity",  "name",  "weight", "over",        "target", "ahead",  "frames",
                 "condition", "lever", "link",   "links",       "point",  "points", "radius",
                 "length",    "axis",  "rpy",    "late_weight", "when",   "sources"});
  Term term;
  const YamlValue quantity = in.at("quantity");
  const auto known = quantity_from_name(quantity.text());
  if (!known)
    quantity.fail(fmt::format("'{}' is no quantity; known: {}", quantity.text(), quantity_names()));
  term.quantity = *known;
  term.name = in.has("name") ? in.at("name").text() : quantity.text();
  if (term.quantity == Quantity::kDuration) check_duration(in, problem);
  if (in.has("frames")) term.frames = read_frames(in.at("frames"), problem.steps);
  if (in.has("when")) term.active = sources.tables.flags(in.at("when"), problem);
  term.condition = in.has("condition") ? in.at("condition").boolean()
                                       : term.quantity == Quantity::kUnactuatedForce;
  if (in.has("length")) term.length = in.at("length").positive();
  if (in.has("late_weight")) {
    if (term.condition) in.at("late_weight").fail("a condition has no weight against others");
    term.late_weight = in.at("late_weight").positive();
  }
  if (of_coordinates(term.quantity)) {
    for (const char* key : {"link", "links", "point", "points", "radius", "axis", "rpy", "sources"})
      if (in.has(key)) in.at(key).fail(quantity.text() + " is of coordinates, not of a link");
    read_coordinate_weights(in, model, problem.motors, term);
    read_coordinate_target(in, model, start, goal, term);
    if (follows(in))
      term.reference =
          read_reference(in.at("target"), problem, term, start, Matrix3::Identity(), sources);
    return {term};
  }
  const int rows = rows_of(model, term.quantity);
  read_vector(in, "weight", rows, 1.0, term.weight);
  if (in.has("over")) term.weight /= in.at("over").positive();
  if (in.has("sources")) return read_source_terms(in, term, sources);
  if (!follows(in) && (in.has("target") || term.quantity == Quantity::kClearance))
    read_vector(in, "target", rows, 0.0, term.target);
  if (in.has("radius")) term.radius = in.at("radius").number(0.0, 1e6);
  if (in.has("axis")) {
    const Vector3 axis = in.at("axis").vector3();
    if (axis.norm() < 1e-9) in.at("axis").fail("an axis cannot be zero");
    term.axis = axis.normalized();
  }
  if (in.has("rpy")) {
    const Vector3 rpy = in.at("rpy").vector3();
    term.orientation = rotation_from_rpy(rpy.x(), rpy.y(), rpy.z());
  }
  std::vector<Term> terms = read_body_terms(in, model, term);
  if (!follows(in)) return terms;
  if (terms.size() != 1 && TargetReader::is_from_file(in.at("target")))
    in.at("target").fail("a target from a file is of one link and one point; write more terms");
  // Targets are of links, whose axes differ from those of their bodies by X_BF.
  for (std::size_t i = 0; i < terms.size(); ++i)
    terms[i].reference =
        read_reference(in.at("target"), problem, terms[i], start,
                       terms[i].orientation.transpose() * term.orientation, sources);
  return terms;
}

}  // namespace counterpoint::optimization
