// Poses and inertias.
#include "counterpoint/model/model.h"
#include "counterpoint/model/spatial.h"
#include "objects/arrays.h"

namespace counterpoint::python {
namespace {

py::array matrix_of(const Pose& X) {
  py::array_t<double> out({4, 4});
  auto m = out.mutable_unchecked<2>();
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j)
      m(i, j) = i == 3 ? (j == 3 ? 1.0 : 0.0) : j == 3 ? X.translation[i] : X.rotation(i, j);
  return out;
}

std::string pose_repr(const Pose& X) {
  const Vector3& p = X.translation;
  const Quaternion q(X.rotation);
  return py::str(
             "Pose(translation=[{:.6g}, {:.6g}, {:.6g}], quaternion=[{:.6g}, {:.6g}, {:.6g}, "
             "{:.6g}])")
      .format(p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z())
      .cast<std::string>();
}

/// One point, or points by row, in the outer frame of X.
py::array moved(const Pose& X, const Array& points) {
  if (points.ndim() == 1) return copy(VectorX(X * vector3(points, "point")));
  const auto given = matrix(points, -1, 3, "points");
  return copy_matrix((given * X.rotation.transpose()).rowwise() + X.translation.transpose());
}

Quaternion quaternion_from(const Array& array) {
  const auto q = vector(array, 4, "quaternion");
  if (!(std::abs(q.norm() - 1.0) < 1e-6))
    throw py::value_error("quaternion: expected unit length (w, x, y, z), found " +
                          std::to_string(q.norm()));
  return Quaternion(q[0], q[1], q[2], q[3]).normalized();
}

Pose make_pose(const py::object& rotation, const Array& translation) {
  Pose X = pose_from(rotation, "rotation");
  X.translation = vector3(translation, "translation");
  return X;
}

SpatialInertia make_inertia(double mass, const Array& center, const Array& rotational) {
  SpatialInertia out{mass, vector3(center, "center"), Matrix3::Zero()};
  if (rotational.ndim() == 1)
    out.rotational.diagonal() = vector3(rotational, "rotational");
  else
    out.rotational = matrix(rotational, 3, 3, "rotational");
  return out;
}

void bind_inertia(py::module_& m) {
  py::class_<SpatialInertia>(m, "SpatialInertia", R"(
Inertia of one rigid body about its centre of mass, in the axes of its frame.

Parameters
----------
mass : float
    [kg]
center : array_like, shape (3,)
    Centre of mass [m].
rotational : array_like, shape (3, 3) or (3,)
    About the centre of mass [kg m^2]; three numbers are its diagonal.
)")
      .def(py::init(&make_inertia), py::arg("mass") = 0.0,
           py::arg("center") = py::make_tuple(0, 0, 0),
           py::arg("rotational") = py::make_tuple(0, 0, 0))
      .def_readwrite("mass", &SpatialInertia::mass, "[kg]")
      .def_property(
          "center", [](const SpatialInertia& x) { return copy(VectorX(x.center)); },
          [](SpatialInertia& x, const Array& a) { x.center = vector3(a, "center"); },
          "Centre of mass in the body frame [m], shape (3,).")
      .def_property(
          "rotational", [](const SpatialInertia& x) { return copy(x.rotational); },
          [](SpatialInertia& x, const Array& a) { x.rotational = matrix(a, 3, 3, "rotational"); },
          "About the centre of mass [kg m^2], shape (3, 3).")
      .def_property_readonly(
          "defect", [](const SpatialInertia& x) { return inertia_defect(x); },
          "Why no rigid body can have this inertia; empty if one can.")
      .def("__repr__", [](const SpatialInertia& x) {
        return py::str("SpatialInertia(mass={:.6g}, center={}, rotational={})")
            .format(x.mass, copy(VectorX(x.center)), copy(x.rotational));
      });
}

}  // namespace

constexpr const char* kPoseDoc = R"(
Rigid transform X_AB: where frame B is in frame A.

Wherever a pose is asked for, (3,) numbers are a translation, (3, 3) a rotation, (4, 4) a
homogeneous matrix, and None is the identity.

Parameters
----------
rotation : array_like, shape (3, 3), optional
    R_AB, orthonormal.
translation : array_like, shape (3,)
    Origin of B in A [m].
)";

void bind_pose(py::module_& m) {
  py::class_<Pose>(m, "Pose", kPoseDoc)
      .def(py::init(&make_pose), py::arg("rotation") = py::none(),
           py::arg("translation") = py::make_tuple(0, 0, 0))
      .def_static(
          "from_quaternion",
          [](const Array& q, const Array& p) {
            return Pose{quaternion_from(q).toRotationMatrix(), vector3(p, "translation")};
          },
          py::arg("quaternion"), py::arg("translation") = py::make_tuple(0, 0, 0),
          "From a unit quaternion (w, x, y, z) and a translation [m].")
      .def_static(
          "from_rpy",
          [](double roll, double pitch, double yaw, const Array& p) {
            return Pose{rotation_from_rpy(roll, pitch, yaw), vector3(p, "translation")};
          },
          py::arg("roll"), py::arg("pitch"), py::arg("yaw"),
          py::arg("translation") = py::make_tuple(0, 0, 0),
          "From URDF's fixed-axis roll, pitch, yaw [rad] and a translation [m].")
      .def_static(
          "from_matrix", [](const Array& given) { return pose_from(given, "matrix"); },
          py::arg("matrix"), "From a homogeneous matrix, shape (4, 4).")
      .def_property_readonly(
          "rotation", [](const Pose& X) { return copy(X.rotation); }, "R_AB, shape (3, 3).")
      .def_property_readonly(
          "translation", [](const Pose& X) { return copy(VectorX(X.translation)); },
          "Origin of B in A [m], shape (3,).")
      .def_property_readonly(
          "quaternion",
          [](const Pose& X) {
            const Quaternion q(X.rotation);
            return copy(VectorX(Eigen::Vector4d(q.w(), q.x(), q.y(), q.z())));
          },
          "Unit quaternion (w, x, y, z).")
      .def_property_readonly("matrix", &matrix_of, "Homogeneous, shape (4, 4).")
      .def("inverse", &Pose::inverse, "X_BA.")
      .def(
          "__matmul__", [](const Pose& X, const Pose& other) { return X * other; },
          py::arg("other"),
          "X_AB @ X_BC is X_AC; X_AB @ points, shape (3,) or (n, 3), are those points in A.")
      .def("__matmul__", &moved, py::arg("other"))
      .def("__repr__", &pose_repr)
      .def(py::pickle([](const Pose& X) { return py::make_tuple(matrix_of(X)); },
                      [](const py::tuple& t) {
                        const auto given = t[0].cast<Array>();
                        const auto X = matrix(given, 4, 4, "matrix");
                        return Pose{X.topLeftCorner<3, 3>(), X.topRightCorner<3, 1>()};
                      }));
  bind_inertia(m);
}

}  // namespace counterpoint::python
