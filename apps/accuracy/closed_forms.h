// Motions that are known in closed form, recognised by what is in the scene.
//
//   free flight      every body is free and nothing can touch: parabola and Euler's top
//   sliding block    one box on the ground plane, flat, no spin, no restitution: Coulomb to the
//   stop sphere to roll   one sphere on the level ground plane: slips until it rolls
#pragma once

#include <string>

#include "reference.h"

namespace counterpoint::apps::accuracy {

struct Recognized {
  ClosedForm motion;        ///< empty: none is known
  std::string description;  ///< what it is, in words
  std::string why_not;      ///< what stands against each of the three
};

/// Looks at model, start and effects; never at names.
Recognized recognize(const Scene& scene);

}  // namespace counterpoint::apps::accuracy
