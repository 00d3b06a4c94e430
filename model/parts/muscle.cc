#include "counterpoint/model/parts/muscle.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

namespace counterpoint {
namespace {

struct Value {
  double y = 0.0, slope = 0.0;
};

/// Returns 0 below 0, 1 above 1, and 6 x^5 - 15 x^4 + 10 x^3 between: twice differentiable.
Value smooth_step(double x) {
  if (x <= 0.0) return {};
  if (x >= 1.0) return {1.0, 0.0};
  return {x * x * x * (10.0 + x * (6.0 * x - 15.0)), 30.0 * x * x * (1.0 - x) * (1.0 - x)};
}

// ---- Curves of Millard et al. 2013: quintic Bezier curves from knot to knot.

/// A point of a curve, and the slope there.
struct Knot {
  double x = 0.0, y = 0.0, slope = 0.0;
};

/// A quintic Bezier curve between two knots. The second and third control points coincide, and the
/// fourth and fifth: the curvature is 0 at both ends.
struct CurvePiece {
  std::array<double, 4> x{}, y{};
};

/// Returns the piece whose double control points lie on the tangents of its ends, at the part
/// 0.1 + 0.8 curviness of the way to the point where the tangents meet.
constexpr CurvePiece piece(const Knot& a, const Knot& b, double curviness) {
  const double part = 0.1 + 0.8 * curviness;
  const double x = (b.y - a.y + a.slope * a.x - b.slope * b.x) / (a.slope - b.slope);
  const double from_a = part * (x - a.x), from_b = part * (x - b.x);
  return {{a.x, a.x + from_a, b.x + from_b, b.x},
          {a.y, a.y + a.slope * from_a, b.y + b.slope * from_b, b.y}};
}

/// The default parameters of the active curve: shortest and longest active fibre, the length where
/// the steep slope becomes shallow, the shallow slope, and half the width of the plateau.
constexpr double kShortest = 0.4441, kTransition = 0.73, kLongest = 1.8123, kShallow = 0.8616,
                 kPlateau = 0.05;
constexpr double kAtTransition = 1.0 - kShallow * (1.0 - kPlateau - kTransition);
constexpr std::array<Knot, 6> kActiveKnots = {
    Knot{kShortest, 0.0, 0.0},
    {0.5 * (kShortest + kTransition), 0.5 * kAtTransition,
     1.25 * kAtTransition / (kTransition - kShortest)},
    {0.5 * (kTransition + 1.0 - kPlateau), 0.5 * (1.0 + kAtTransition), kShallow},
    {1.0, 1.0, 0.0},
    {0.5 * (1.0 + kPlateau + kLongest), 0.5, -1.0 / (kLongest - 1.0 - 2.0 * kPlateau)},
    {kLongest, 0.0, 0.0}};
constexpr std::array<CurvePiece, 5> kActiveCurve = {
    piece(kActiveKnots[0], kActiveKnots[1], 1.0), piece(kActiveKnots[1], kActiveKnots[2], 1.0),
    piece(kActiveKnots[2], kActiveKnots[3], 1.0), piece(kActiveKnots[3], kActiveKnots[4], 1.0),
    piece(kActiveKnots[4], kActiveKnots[5], 1.0)};

/// The default parameters of the passive curve: strain and stiffness where the force is max_force,
/// and the stiffness at the end of its foot, which is a twentieth of the strain long.
constexpr double kStrain = 0.7, kStiffness = 2.0 / kStrain, kFootStiffness = 0.2,
                 kFoot = 0.1 / kStiffness;
constexpr std::array<Knot, 3> kPassiveKnots = {
    Knot{1.0, 0.0, 0.0},
    {1.0 + kFoot, 0.5 * kFoot* kFootStiffness, kFootStiffness},
    {1.0 + kStrain, 1.0, kStiffness}};
constexpr std::array<CurvePiece, 2> kPassiveCurve = {
    piece(kPassiveKnots[0], kPassiveKnots[1], 0.75),
    piece(kPassiveKnots[1], kPassiveKnots[2], 0.75)};

/// The default parameters of the curve over the speed: the largest force of a lengthening fibre,
/// the slope at rest, and the slopes at nine tenths of the largest speeds.
constexpr double kEccentric = 1.4, kSlopeAtRest = 5.0, kNearShortening = 0.25,
                 kNearLengthening = 0.15;
constexpr std::array<Knot, 5> kSpeedKnots = {
    Knot{-1.0, 0.0, 0.0},
    {-0.9, 0.05 * kNearShortening, kNearShortening},
    {0.0, 1.0, kSlopeAtRest},
    {0.9, kEccentric - 0.05 * kNearLengthening, kNearLengthening},
    {1.0, kEccentric, 0.0}};
constexpr std::array<CurvePiece, 4> kSpeedCurve = {
    piece(kSpeedKnots[0], kSpeedKnots[1], 0.6), piece(kSpeedKnots[1], kSpeedKnots[2], 0.6),
    piece(kSpeedKnots[2], kSpeedKnots[3], 0.9), piece(kSpeedKnots[3], kSpeedKnots[4], 0.9)};

double bezier(const std::array<double, 4>& p, double u) {
  const double w = 1.0 - u;
  return w * w * w * (w * w * p[0] + 5.0 * u * (1.0 + u) * p[1]) +
         u * u * u * (u * u * p[3] + 5.0 * w * (1.0 + w) * p[2]);
}

double bezier_slope(const std::array<double, 4>& p, double u) {
  const double w = 1.0 - u;
  return 5.0 * (w * w * w * w * (p[1] - p[0]) + 6.0 * u * u * w * w * (p[2] - p[1]) +
                u * u * u * u * (p[3] - p[2]));
}

/// Returns the parameter of a piece at x between its ends. Newton's method within a bracket that
/// shrinks: x grows with the parameter, since its control points ascend.
double parameter_at(const CurvePiece& piece, double x) {
  double low = 0.0, high = 1.0, u = (x - piece.x[0]) / (piece.x[3] - piece.x[0]);
  for (int i = 0; i < 100; ++i) {
    const double error = bezier(piece.x, u) - x;
    (error > 0.0 ? high : low) = u;
    const double next = u - error / bezier_slope(piece.x, u);
    // The error after a step of Newton's method is of the order of the square of the step.
    if (std::abs(next - u) < 1e-9) return std::clamp(next, 0.0, 1.0);
    u = next > low && next < high ? next : 0.5 * (low + high);
  }
  return u;
}

/// Returns a curve of pieces, which goes on along its tangents beyond its ends.
Value curve_at(std::span<const CurvePiece> pieces, double x) {
  const CurvePiece &first = pieces.front(), &last = pieces.back();
  const auto tangent = [x](const CurvePiece& p, int at, int from, int to) {
    const double slope = (p.y[to] - p.y[from]) / (p.x[to] - p.x[from]);
    return Value{p.y[at] + slope * (x - p.x[at]), slope};
  };
  if (x <= first.x[0]) return tangent(first, 0, 0, 1);
  if (x >= last.x[3]) return tangent(last, 3, 2, 3);
  const auto here =
      std::find_if(pieces.begin(), pieces.end(), [x](const CurvePiece& p) { return x < p.x[3]; });
  const double u = parameter_at(*here, x);
  return {bezier(here->y, u), bezier_slope(here->y, u) / bezier_slope(here->x, u)};
}

// ---- The curves of MuJoCo: parabolas from knot to knot.

Value mujoco_active(const Muscle& m, double x) {
  if (x <= m.shortest || x >= m.longest) return {};
  const double end = x < 1.0 ? m.shortest : m.longest, width = 0.5 * (1.0 - end);
  const double from_end = (x - end) / width, from_top = (1.0 - x) / width;
  if (from_end < 1.0) return {0.5 * from_end * from_end, from_end / width};
  return {1.0 - 0.5 * from_top * from_top, from_top / width};
}

Value mujoco_passive(const Muscle& m, double x) {
  if (x <= 1.0) return {};
  const double width = 0.5 * (m.longest - 1.0), strain = (x - 1.0) / width;
  if (strain < 1.0)
    return {0.5 * m.passive_force * strain * strain, m.passive_force * strain / width};
  return {m.passive_force * (strain - 0.5), m.passive_force / width};
}

Value mujoco_speed(const Muscle& m, double v) {
  const double most = m.eccentric_force - 1.0;
  if (v <= -1.0) return {};
  if (v <= 0.0) return {(1.0 + v) * (1.0 + v), 2.0 * (1.0 + v)};
  if (v >= most) return {m.eccentric_force, 0.0};
  return {m.eccentric_force - (most - v) * (most - v) / most, 2.0 * (most - v) / most};
}

// ---- Forces, over max_force, of lengths x in optimal lengths and speeds v in largest ones.

MuscleForce mujoco_force(const Muscle& m, double activation, double x, double v) {
  const Value active = mujoco_active(m, x), passive = mujoco_passive(m, x),
              speed = mujoco_speed(m, v);
  return {activation * active.y * speed.y + passive.y,
          activation * active.slope * speed.y + passive.slope, activation * active.y * speed.slope,
          active.y * speed.y};
}

/// Parts of max_force and of the optimal length below which a force, and the fibre along the
/// tendon, fade to nothing.
constexpr double kFadingForce = 0.01, kFadingLength = 0.1;

/// Returns 0 for a force that pushes and the force itself above kFadingForce: twice differentiable
/// and ascending.
Value pulling_part(double force) {
  const double t = force / kFadingForce;
  if (t <= 0.0) return {};
  if (t >= 1.0) return {force, 1.0};
  return {kFadingForce * t * t * t * (6.0 + t * (3.0 * t - 8.0)),
          t * t * (18.0 + t * (15.0 * t - 32.0))};
}

MuscleForce millard_force(const Muscle& m, double activation, double x, double v) {
  if (x <= 0.0) return {};
  const double width = std::sin(m.pennation), length = std::hypot(x, width);
  const double cosine = x / length, cosine_slope = width / length * (width / length) / length;
  const double fibre_speed = v * cosine;
  const Value active = curve_at(kActiveCurve, length), passive = curve_at(kPassiveCurve, length),
              speed = curve_at(kSpeedCurve, fibre_speed), fading = smooth_step(x / kFadingLength);
  const double fibre = activation * active.y * speed.y + passive.y + m.damping * fibre_speed;
  const double by_fibre_speed = activation * active.y * speed.slope + m.damping;
  const double by_x = (activation * active.slope * speed.y + passive.slope) * cosine +
                      by_fibre_speed * v * cosine_slope;
  const double along = cosine * fading.y;  // the part of the fibre's force along the tendon
  const double along_slope = cosine_slope * fading.y + cosine * fading.slope / kFadingLength;
  const Value pull = pulling_part(fibre * along);
  return {pull.y, pull.slope * (by_x * along + fibre * along_slope),
          pull.slope * by_fibre_speed * cosine * along, pull.slope * active.y * speed.y * along};
}

/// Time constant of the activation [s].
double time_constant(const Muscle& m, double activation, double excitation) {
  const double factor = 0.5 + 1.5 * activation, rise = excitation - activation;
  const double up = m.activation_time * factor, down = m.deactivation_time / factor;
  if (m.activation_smoothing <= 0.0) return rise > 0.0 ? up : down;
  return down + (up - down) * smooth_step(rise / m.activation_smoothing + 0.5).y;
}

}  // namespace

MuscleForce muscle_force(const Muscle& muscle, double activation, double length, double speed) {
  constexpr double kFar = 1e9;  // farther lengths and speeds count as this one: no overflow
  const double fastest = muscle.optimal_length * muscle.max_speed;
  const double x = std::clamp((length - muscle.slack_length) / muscle.optimal_length, -kFar, kFar);
  const double v = std::clamp(speed / fastest, -kFar, kFar);
  const double a = std::clamp(activation, 0.0, 1.0);
  const MuscleForce f = muscle.curves == Muscle::Curves::kMujoco ? mujoco_force(muscle, a, x, v)
                                                                 : millard_force(muscle, a, x, v);
  return {muscle.max_force * f.force, muscle.max_force * f.by_length / muscle.optimal_length,
          muscle.max_force * f.by_speed / fastest, muscle.max_force * f.by_activation};
}

double next_activation(const Muscle& muscle, double activation, double excitation, double h) {
  const double a = std::clamp(activation, 0.0, 1.0), u = std::clamp(excitation, 0.0, 1.0);
  const auto advance = [&](double from_time_constant, double time) {
    return std::lerp(a, u, -std::expm1(-time / from_time_constant));
  };
  const double middle = advance(time_constant(muscle, a, u), 0.5 * h);
  return std::clamp(advance(time_constant(muscle, middle, u), h), std::min(a, u), std::max(a, u));
}

}  // namespace counterpoint
