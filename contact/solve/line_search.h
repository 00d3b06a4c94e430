// Line search on the derivative of a convex function of one variable: bracketed Newton.
#pragma once

#include <algorithm>
#include <cmath>

#include "counterpoint/contact/problem.h"

namespace counterpoint::contact {

struct LineSearchResult {
  double step = 0.0;   ///< step length alpha
  bool found = false;  ///< whether |phi'(alpha)| is small enough
  int evaluations = 0;
};

/// Finds alpha > 0 with |phi'(alpha)| <= accuracy * |phi'(0)|, trying alpha = 1 first. `derivative`
/// returns phi' and phi'' of a convex phi as a Slope; slope_at_zero is phi'(0) < 0.
template <class Derivative>
LineSearchResult search_line(const Derivative& derivative, double slope_at_zero, double accuracy) {
  // Newton steps may creep up to a kink from one side: if kPatience of them do not halve the
  // bracket, it is bisected.
  constexpr int kPatience = 3;
  const double goal = accuracy * std::abs(slope_at_zero);
  double low = 0.0, high = 0.0;  // high = 0: no bracket yet
  double width = 0.0;            // width of the bracket when it had last halved
  int since = 0;
  double alpha = 1.0;
  LineSearchResult out;
  while (std::isfinite(alpha)) {
    const Slope s = derivative(alpha);
    ++out.evaluations;
    out.step = alpha;
    if (std::abs(s.first) <= goal) {
      out.found = true;
      return out;
    }
    if (!std::isfinite(s.first) || s.first > 0.0) {
      high = alpha;
    } else {
      low = alpha;
    }
    double next = std::isfinite(s.first) && s.second > 0.0 ? alpha - s.first / s.second : alpha;
    if (high == 0.0) {
      // The step at most doubles until phi' changes its sign.
      alpha = next > low ? std::min(next, 2.0 * low) : 2.0 * low;
      continue;
    }
    if (width == 0.0 || high - low <= 0.5 * width) {
      width = high - low;
      since = 0;
    }
    if (!(next > low && next < high) || ++since > kPatience) {
      next = 0.5 * (low + high);
      if (next <= low || next >= high) return out;
    }
    alpha = next;
  }
  return out;
}

}  // namespace counterpoint::contact
