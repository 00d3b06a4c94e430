// Definitions for builds without MuJoCo.
#include "mujoco.h"
#include "mujoco_file.h"

namespace counterpoint::peers {

std::string mujoco_version() { return {}; }

struct Mujoco::Impl {
  State state;
  std::vector<ContactForce> contacts;
  std::vector<ClosureForce> closures;
};

Mujoco::Mujoco(const Scene&, MujocoSettings) {
  throw NotExpressible("MuJoCo was not found when this was built");
}
Mujoco::~Mujoco() = default;

// These are never called, because no object can be constructed.
void Mujoco::set_time_step(double) {}
void Mujoco::set_state(const State&) {}
const State& Mujoco::state() const { return impl_->state; }
MujocoStep Mujoco::step(const Input&) { return {}; }
std::string Mujoco::run(long) { return {}; }
void Mujoco::finish_run() {}
std::string Mujoco::step_from(MujocoMoment&) { return {}; }
void Mujoco::run_inverse(const MujocoMoment*, std::size_t) {}
Mujoco::InverseForces Mujoco::inverse_forces() const { return {}; }
std::size_t Mujoco::memory() const { return 0; }
mjModel_* Mujoco::own_model() const { return nullptr; }
mjData_* Mujoco::own_data() const { return nullptr; }
const std::vector<ContactForce>& Mujoco::contacts() const { return impl_->contacts; }
const std::vector<ClosureForce>& Mujoco::closures() const { return impl_->closures; }
std::vector<Pose> Mujoco::poses() const { return {}; }
std::vector<Motion> Mujoco::velocities() const { return {}; }
double Mujoco::energy() const { return 0.0; }
MatrixX Mujoco::mass_matrix() const { return {}; }

std::vector<Pose> play_mjcf(const std::string&, double) {
  throw NotExpressible("MuJoCo was not found when this was built");
}
MjcfReadings read_mjcf_sensors(const std::string&, const VectorX&, const VectorX&, double) {
  throw NotExpressible("MuJoCo was not found when this was built");
}

}  // namespace counterpoint::peers
