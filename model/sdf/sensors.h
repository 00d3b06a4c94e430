// Sensors of SDF's links and joints as sensors of a scene.
#pragma once

#include <optional>
#include <sdf/ForceTorque.hh>
#include <sdf/Sensor.hh>

#include "counterpoint/model/sdf/document.h"

namespace counterpoint::sdf_file {

/// Adds what a sensor of a link reads, or a note that it has no counterpart. `link`: the link's
/// name in its SDF model, `name`: in the scene.
void read_link_sensor(Document& document, const sdf::Sensor& in, const std::string& link,
                      const std::string& name, std::vector<SensorSpec>& out);

/// A force_torque sensor before the place of its joint in a tree is known.
struct WrenchSensor {
  SensorSpec spec;  ///< name, kinds and errors
  sdf::ForceTorqueFrame axes = sdf::ForceTorqueFrame::CHILD;
  bool on_parent = true;               ///< child_to_parent: the wrench on the joint's parent
  Matrix3 R_JS = Matrix3::Identity();  ///< orientation of the sensor in the joint frame
};

/// Reads a sensor of a joint; nothing, and a note, if it is no force_torque sensor.
std::optional<WrenchSensor> read_joint_sensor(Document& document, const sdf::Sensor& in,
                                              const std::string& joint, const std::string& name);

/// The place of a file's joint in a tree. Its frame J moves with the joint's child; poses are those
/// at the zero of its coordinates.
struct TreeJoint {
  std::string name;
  std::vector<std::string> motions;  ///< joints in series, the outermost last; none if it is fixed
  bool turns = false;                ///< a motion is no translation
  bool reversed = false;             ///< the joint's child is the inner link, nearer to the root
  std::string inner, outer;          ///< links
  Pose X_IJ, X_OJ;                   ///< J in the frames of both
};

/// Adds the sensor of a joint. If its axes turn with the inner link, that link first gets one
/// without mass, JOINT.meter, through which the joint pushes it.
void place_wrench(const WrenchSensor& in, const TreeJoint& at, RobotSpec& robot,
                  std::vector<SensorSpec>& out);

}  // namespace counterpoint::sdf_file
