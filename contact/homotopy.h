// The way to a solution that cannot be missed: a curve from a problem with one solution, followed
// by its arc length.
//
// Along p >= 0 the laws have the smoothing k + c0 e^-p and the share 1 - e^-p of De Saxce's shift.
// At p = 0 the problem is convex and smooth. For every p the impulses of all solutions are bounded
// (the shift is never negative, so f = 0 always costs more: f'(A + R)f / 2 <= -f'(c + b)), hence by
// Leray and Schauder's continuation theorem the curve of solutions that starts at p = 0 reaches
// every p; with Coulomb laws it may turn back in p on the way, and a predictor along its tangent
// with a corrector across it follows it through such folds, where a method that only shrinks the
// smoothing stops. It also follows convex problems, whose curve never turns.
//
// Source: Allgower and Georg, "Introduction to Numerical Continuation Methods", 2003, for the
// predictor and corrector; Acary, Cadoux, Lemarechal and Malick, 2011, for existence by the shift.
#pragma once

#include "counterpoint/contact/mixed_newton.h"
#include "counterpoint/contact/mixed_system.h"

namespace counterpoint::contact {

class Homotopy {
 public:
  /// At most `max_iterations` steps of Newton's method in all. `point` is the answer if solved.
  /// `least_cosine`: between the tangents at both ends of a step; nearer to 1, smaller steps.
  MixedNewton::Result run(MixedSystem& system, MixedNewton& newton, double least_cosine,
                          int max_iterations, MixedSystem::Point& point);

  /// As MixedSystem::reserve.
  void reserve(const IslandSystem& system);

 private:
  /// A point of the curve or a direction along it.
  struct Curve {
    MixedSystem::Point point;
    double p = 0.0;
  };
  void set_parameter(MixedSystem& system, double p) const;
  double inner(const MixedSystem& system, const Curve& a, const Curve& b) const;
  bool start(MixedSystem& system, MixedNewton& newton, MixedSystem::Point& point);
  bool find_tangent(MixedSystem& system, const Curve& at, Curve& tangent);
  bool correct(MixedSystem& system, int& iterations);
  bool advance(MixedSystem& system);
  bool reached(MixedSystem& system, double share);

  double start_center_ = 0.0;
  double metric_ = 1.0;  ///< of p against the rest [J]
  double step_length_ = 0.0;
  double cones_ = 1.0;
  double least_cosine_ = 0.5;
  int budget_ = 0, used_ = 0;
  Curve here_, trial_, before_, tangent_, next_tangent_;
  MixedSystem::Point step_, slope_, jump_;
};

}  // namespace counterpoint::contact
