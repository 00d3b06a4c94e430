// Motions and states in files: tables, trajectories, columns of inputs, states to resume from.
#pragma once

#include "counterpoint/engine/io/input_columns.h"
#include "counterpoint/engine/io/state_file.h"
#include "counterpoint/engine/io/table.h"
#include "counterpoint/engine/io/trajectory.h"
