// Pinocchio as a peer: a robot from the same URDF, at states given joint by joint. Optional:
// without Pinocchio at build time, load() says so.
//
// It lives in a module of its own, opened at run time, that shares nothing but plain numbers with
// this program: Pinocchio wants Eigen with the alignment that its processor flags give, the engine
// with that of Debian's libraries, and one program may hold only one of them.
#pragma once

#include <memory>
#include <string>

namespace counterpoint::peers {

enum class PinocchioAlgorithm {
  kKinematics,
  kRnea,
  kAba,
  kCrba,
  kRneaDerivatives,
  kAbaDerivatives
};

/// Where the module keeps the coordinates of a joint.
struct PinocchioJoint {
  int index = 0;            ///< among all joints, in the order of their positions
  int q_index = 0, nq = 0;  ///< 7: free (x y z, qx qy qz qw); 2: (cos, sin) of an angle
  int v_index = 0, nv = 0;  ///< 6: linear, then angular, both in the axes of the body
};

/// One robot. Not thread-safe.
class PinocchioRobot {
 public:
  virtual ~PinocchioRobot() = default;
  virtual int nq() const = 0;
  virtual int nv() const = 0;
  /// False if there is no such joint. "" is the joint of the root.
  virtual bool find_joint(const char* name, PinocchioJoint* joint) const = 0;
  /// Room for `count` states of (q, v, x), x being the acceleration or the force.
  virtual void set_states(int count, const double* q, const double* v, const double* x) = 0;
  /// Evaluates at states 0, 1, ..., evaluations - 1, counted around.
  virtual void run(PinocchioAlgorithm algorithm, int evaluations) = 0;
  /// At one state. tau or acceleration (nv), M (nv x nv), the joints' origins (3 each), or the
  /// derivatives of tau by (q, v, a), of a by (q, v, tau), nv x nv each. Returns how many numbers
  /// there are.
  virtual int evaluate(PinocchioAlgorithm algorithm, int state, double* out) = 0;
};

/// Which way each algorithm goes, of the two that Pinocchio has for some of them.
enum class PinocchioConvention { kWorld, kLocal };

/// Version and flags of the module, or "": there is none.
std::string pinocchio_version();

/// `floating`: with a free joint at the root. gravity: three numbers [m/s^2].
/// @throws std::runtime_error where it cannot be read, or there is no module.
std::unique_ptr<PinocchioRobot> load_pinocchio(const std::string& urdf, bool floating,
                                               const double* gravity,
                                               PinocchioConvention convention);

}  // namespace counterpoint::peers
