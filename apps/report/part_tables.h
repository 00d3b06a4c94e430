// Joints, closures, tendons and actuators in reports.
#pragma once

#include "counterpoint/model/model.h"
#include "report/report.h"

namespace counterpoint::apps {

inline Json vector_json(const Vector3& v) { return {v.x(), v.y(), v.z()}; }

/// Returns the values of a closure and how far it is open, without the names of its links.
Json closure_json(const Closure& closure, const ClosureGap& gap);

/// Returns spring and servo of a joint; null if it has none.
Json joint_forces_json(const Model& model, int joint);

/// Prints and reports the tendons (key "tendons"): lengths in the initial configuration, and their
/// forces; nothing if there are none.
void report_tendons(const Model& model, Report& report);

/// Prints and reports the actuators (key "actuators"): their places, laws and commands;
/// nothing if there are none.
void report_actuators(const Model& model, Report& report);

}  // namespace counterpoint::apps
