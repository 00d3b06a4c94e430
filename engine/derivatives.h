// Derivatives: of steps and their inverse by state and input, of the inverse by figures of the model,
// and of the algorithms of dynamics.
#pragma once

#include "counterpoint/engine/derivatives/dynamics/aba_derivatives.h"
#include "counterpoint/engine/derivatives/dynamics/inertia_regressor.h"
#include "counterpoint/engine/derivatives/dynamics/rnea_derivatives.h"
#include "counterpoint/engine/parameter_derivatives.h"
#include "counterpoint/engine/step_derivatives.h"
