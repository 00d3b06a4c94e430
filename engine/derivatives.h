// Derivatives of steps and their inverse by state and input, and by figures of the model. Those of
// inverse and forward dynamics without contacts: dynamics.h.
#pragma once

#include "counterpoint/engine/parameter_derivatives.h"
#include "counterpoint/engine/step_derivatives.h"
