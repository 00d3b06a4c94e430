// Motions with a known closed form, recognized from the content of the scene.
//
//   free flight      every body is free and nothing can touch: parabola and Euler's top
//   sliding block    one box flat on the ground plane, no spin, no restitution: Coulomb friction
//   sphere to roll   one sphere on the level ground plane: slips until it rolls
#pragma once

#include <string>

#include "reference.h"

namespace counterpoint::apps::accuracy {

struct Recognized {
  ClosedForm motion;        ///< empty: no closed form is known
  std::string description;  ///< name of the closed form, in words
  std::string why_not;      ///< why each of the three does not apply
};

/// Decides from the model, the start and the effects; never from names.
Recognized recognize(const Scene& scene);

}  // namespace counterpoint::apps::accuracy
