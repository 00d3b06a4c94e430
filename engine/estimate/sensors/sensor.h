// Sensors in addition to recorded coordinates, and their readings at their own times.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "counterpoint/model/model.h"

namespace counterpoint::estimation {

/// Source of one value: scale * column + offset, or the constant `offset` if `column` is empty.
struct ColumnSource {
  std::string column;
  double scale = 1.0;
  double offset = 0.0;
};

enum class SensorKind {
  kPoint,            ///< position of a point of a link, in W [m]
  kOrientation,      ///< orientation of axes on a link: quaternion w, x, y, z from these axes to W
  kAngularVelocity,  ///< angular velocity of a link, in sensor axes [rad/s]
  kSpecificForce,    ///< acceleration of a point of a link minus gravity, in sensor axes [m/s^2]
  kCoordinate,       ///< position of a one-coordinate joint [m, rad]
  kContactForce,     ///< sum of the contact forces on some links, in W [N]
  kJointForce,       ///< applied force of a one-coordinate joint [N, N m]
  kLinkForce,        ///< force on a link from its parent through the joint, in sensor axes [N]
  kLinkTorque,       ///< moment of the same about the sensor's point, in sensor axes [N m]
  kOther,            ///< another quantity of a sensor of the scene; not for estimates
};
/// Number of values of a reading, and number of components of its error.
int reading_size(SensorKind kind);
int error_size(SensorKind kind);
/// Name of the kind in column maps, and unit of a component of its error.
const char* sensor_kind_name(SensorKind kind);
const char* sensor_unit(SensorKind kind);

struct Sensor {
  std::string name;
  SensorKind kind = SensorKind::kPoint;
  int body = 0;                        ///< 0: world
  Vector3 point = Vector3::Zero();     ///< in body axes [m]
  Matrix3 axes = Matrix3::Identity();  ///< R_BS: rotation from sensor axes to body axes
  int coordinate = -1, position = -1;  ///< indices into v and q of a joint
  std::vector<int> bodies;             ///< kContactForce only
  std::vector<ColumnSource> columns;   ///< reading_size(kind) columns; kOther: any number
  std::string source;                  ///< name in ColumnMap::sources; empty: the recording itself
  /// Standard deviation of a component of a reading; NaN: estimated from the readings.
  double deviation = std::numeric_limits<double>::quiet_NaN();
  /// Index into Model::sensors, and into the rows of that sensor, of the first column; -1: the
  /// column map describes the sensor.
  int scene_sensor = -1, scene_row = 0;
  /// Unknown constants: readings = (1 + scale) value + offset, of a sensor that is displaced from
  /// `point` along `axes`, and turned from them.
  bool has_offset = false, has_scale = false, has_placement = false;
};

/// Another file with readings of the same motion.
struct SensorSource {
  std::string name;
  std::vector<ColumnSource> time;  ///< columns whose sum is the time [s]; empty: `rate` is used
  double rate = 0.0;               ///< rows per second, the first at 0 s
  bool time_unit_given = false;
  /// Delay of its clock: an event at time t has the time stamp t + delay [s].
  double delay = 0.0;
  double delay_deviation = 0.0;  ///< standard deviation of the delay [s]; 0: the delay is known
};

/// The readings of a sensor.
struct SensorReadings {
  std::vector<double> time;  ///< increasing [s]
  MatrixX values;            ///< reading_size x rows; NaN: missing
};

/// A constant that is estimated together with the motion.
struct SensorConstant {
  std::string name;
  std::string unit;
  double deviation = 0.0;  ///< standard deviation of its prior, which has mean 0
};

// ---- Sensors of the scene as measurements: an entry of `sensors` in a column map without a kind.

/// Returns one measurement for each kind of a sensor of the model (Model::sensors), with the names
/// of its columns and the deviation of its noise; kOther where a quantity has no counterpart.
std::vector<Sensor> scene_measurements(const Model& model, int index);

}  // namespace counterpoint::estimation
