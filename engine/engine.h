// What a user of the engine includes.
#pragma once

#include "counterpoint/engine/batch.h"
#include "counterpoint/engine/simulator.h"
#include "counterpoint/engine/step.h"
#include "counterpoint/engine/step_derivatives.h"
#include "counterpoint/model/scene.h"
