// Calls of MuJoCo that need care: it ends the program on errors and writes files on warnings unless
// told otherwise.
#pragma once

#include <string>

struct mjModel_;
struct mjData_;

namespace counterpoint::peers {

/// Errors from here on are those of guarded_step; warnings are read from mjData.
void keep_quiet();

/// mj_step. Returns the error that MuJoCo reported, or "": the data must not be stepped on after
/// one.
std::string guarded_step(const mjModel_* m, mjData_* d);
/// The same, `count` times.
std::string guarded_steps(const mjModel_* m, mjData_* d, long count);

/// As MJCF names the integrator that is implicit in velocity and best for accuracy here.
const char* implicit_integrator();

/// Compiles MJCF from memory; the caller deletes the model. @throws NotExpressible.
mjModel_* compile(const std::string& document);

}  // namespace counterpoint::peers
