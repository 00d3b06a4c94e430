// The algorithms of dynamics by themselves, without contacts and steps: kinematics, inverse dynamics
// (RNEA), forward dynamics (ABA), the mass matrix (CRBA), energy, and integration of configurations.
#pragma once

#include "counterpoint/engine/dynamics/aba.h"
#include "counterpoint/engine/dynamics/crba.h"
#include "counterpoint/engine/dynamics/data.h"
#include "counterpoint/engine/dynamics/energy.h"
#include "counterpoint/engine/dynamics/frame_motion.h"
#include "counterpoint/engine/dynamics/gravity_compensation.h"
#include "counterpoint/engine/dynamics/integrator.h"
#include "counterpoint/engine/dynamics/kinematics.h"
#include "counterpoint/engine/dynamics/rnea.h"
#include "counterpoint/engine/forces/effort_limits.h"
#include "counterpoint/engine/forces/springs.h"
