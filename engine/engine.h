// Scenes and their motion: load or build a scene, step it, invert it, run batches of it.
#pragma once

#include "counterpoint/engine/batch.h"
#include "counterpoint/engine/derivatives.h"
#include "counterpoint/engine/effects.h"
#include "counterpoint/engine/simulator.h"
#include "counterpoint/engine/step.h"
#include "counterpoint/model/model_builder.h"
#include "counterpoint/model/scene.h"
