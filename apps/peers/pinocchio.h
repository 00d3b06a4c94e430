// Pinocchio with our interface: a robot from the same URDF, at states given joint by joint.
// Optional: without Pinocchio at build time, load_pinocchio() throws.
//
// It is a separate module, opened at run time, that exchanges plain numbers only: Pinocchio needs
// Eigen with the alignment of its processor flags, the engine with that of Debian's libraries, and
// one program can contain only one of them.
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

/// Indices of a joint's coordinates in the module.
struct PinocchioJoint {
  int index = 0;            ///< among all joints, in the order of their positions
  int q_index = 0, nq = 0;  ///< 7: free (x y z, qx qy qz qw); 2: (cos, sin) of an angle
  int v_index = 0, nv = 0;  ///< 6: linear, then angular velocity, both in the body-fixed frame
};

/// One robot. Not thread-safe.
class PinocchioRobot {
 public:
  virtual ~PinocchioRobot() = default;
  virtual int nq() const = 0;
  virtual int nv() const = 0;
  /// False if there is no such joint. "" means the joint of the root.
  virtual bool find_joint(const char* name, PinocchioJoint* joint) const = 0;
  /// Copies `count` states of (q, v, x), where x is the acceleration or the force.
  virtual void set_states(int count, const double* q, const double* v, const double* x) = 0;
  /// Evaluates the algorithm `evaluations` times, at the states in turn.
  virtual void run(PinocchioAlgorithm algorithm, int evaluations) = 0;
  /// Evaluates at one state: tau or acceleration (nv), M (nv x nv), origins of the joints (3 each),
  /// or the derivatives of tau with respect to (q, v, a), or of a with respect to (q, v, tau), nv x
  /// nv each. Returns the number of values.
  virtual int evaluate(PinocchioAlgorithm algorithm, int state, double* out) = 0;
};

/// Convention of algorithms for which Pinocchio has two implementations.
enum class PinocchioConvention { kWorld, kLocal };

/// Version and compiler flags of the module; "" without the module.
std::string pinocchio_version();

/// `floating`: with a free joint at the root. gravity: three numbers [m/s^2]. @throws
/// std::runtime_error if the URDF cannot be read, or without the module.
std::unique_ptr<PinocchioRobot> load_pinocchio(const std::string& urdf, bool floating,
                                               const double* gravity,
                                               PinocchioConvention convention);

}  // namespace counterpoint::peers
