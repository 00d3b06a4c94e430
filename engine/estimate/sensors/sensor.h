// Sensors beside recorded coordinates: what each measures, and its readings at their own times.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "counterpoint/model/model.h"

namespace counterpoint::estimation {

/// Value of one coordinate: scale * column + offset, or a constant where `column` is empty.
struct ColumnSource {
  std::string column;
  double scale = 1.0;
  double offset = 0.0;
};

enum class SensorKind {
  kPoint,            ///< position of a point of a link, in W [m]
  kOrientation,      ///< orientation of axes on a link, as a quaternion w, x, y, z from these to W
  kAngularVelocity,  ///< angular velocity of a link, in the axes of the sensor [rad/s]
  kSpecificForce,    ///< acceleration of a point of a link less gravity, in the axes of the sensor
                     ///< [m/s^2]
  kCoordinate,       ///< position of a joint of one coordinate [m, rad]
  kContactForce,     ///< sum of the contact forces on some links, in W [N]
  kJointForce,       ///< applied force of a joint of one coordinate [N, N m]
  kLinkForce,        ///< force through a link's joint, from the parent, in the sensor's axes [N]
  kLinkTorque,       ///< moment of that about the sensor's point, in the sensor's axes [N m]
};
/// Numbers that a reading has, and components of its error.
int reading_size(SensorKind kind);
int error_size(SensorKind kind);
/// The kind as column maps name it, and the unit of a component of its error.
const char* sensor_kind_name(SensorKind kind);
const char* sensor_unit(SensorKind kind);

struct Sensor {
  std::string name;
  SensorKind kind = SensorKind::kPoint;
  int body = 0;                        ///< 0: world
  Vector3 point = Vector3::Zero();     ///< in the body's axes [m]
  Matrix3 axes = Matrix3::Identity();  ///< R_BS: from the sensor's axes to the body's
  int coordinate = -1, position = -1;  ///< indices into v and q, of a joint
  std::vector<int> bodies;             ///< kContactForce only
  std::vector<ColumnSource> columns;   ///< reading_size
  std::string source;                  ///< ColumnMap::sources; empty: the recording itself
  /// Standard deviation of a component of a reading; NaN: found from the readings.
  double deviation = std::numeric_limits<double>::quiet_NaN();
  /// The readings differ by an unknown constant from what is measured.
  bool has_offset = false;
};

/// Another file with readings of the same motion.
struct SensorSource {
  std::string name;
  std::vector<ColumnSource> time;  ///< their sum [s]; none: `rate` holds
  double rate = 0.0;               ///< rows per second, the first at 0 s
  bool time_unit_given = false;
  /// Its clock is late: what it says at time t happened at t - delay [s].
  double delay = 0.0;
  double delay_deviation = 0.0;  ///< standard deviation of that [s]; 0: it is known
};

/// The readings of a sensor.
struct SensorReadings {
  std::vector<double> time;  ///< rising [s]
  MatrixX values;            ///< reading_size x rows; NaN: missing
};

/// A constant that is estimated beside the motion.
struct SensorConstant {
  std::string name;
  std::string unit;
  double deviation = 0.0;  ///< standard deviation of its prior, whose mean is 0
};

}  // namespace counterpoint::estimation
