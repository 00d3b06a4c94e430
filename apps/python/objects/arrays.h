// NumPy arrays as arguments and results: views that keep their owner alive, copies, size checks.
#pragma once

#include <pybind11/numpy.h>

#include <string>
#include <vector>

#include "bindings.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint::python {

/// An argument: anything that NumPy converts to a row-major array of doubles; not copied if it is
/// one already.
using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Shape1 = std::vector<py::ssize_t>;

using ConstMap = Eigen::Map<const VectorX>;
using ConstRowMap =
    Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>;

/// @throws py::value_error "q: expected shape (7,), found (3,)".
void check_shape(const py::array& array, const Shape1& shape, const char* name);
/// "(3, 4)".
std::string shape_text(const py::array& array);

/// Returns the entries of a vector without a copy. @throws py::value_error for another size.
ConstMap vector(const Array& array, Eigen::Index size, const char* name);
/// Returns the entries of a matrix without a copy. @throws py::value_error for another shape.
ConstRowMap matrix(const Array& array, Eigen::Index rows, Eigen::Index columns, const char* name);
Vector3 vector3(const Array& array, const char* name);
/// Returns the entries of an optional argument, or `otherwise` for None.
VectorX vector_or(const py::object& given, const VectorX& otherwise, const char* name);

/// Array that shows `data`, with strides in doubles; keeps `owner` alive.
py::array view(const double* data, const Shape1& shape, const Shape1& strides, py::handle owner,
               bool writable = false);
/// Array that shows a whole vector.
py::array view(const VectorX& x, py::handle owner, bool writable = false);
/// Array that shows a matrix of Eigen (column-major) with the same rows and columns.
py::array view(const MatrixX& m, py::handle owner, bool writable = false);
/// Array that shows the transpose of a matrix: its columns as rows.
py::array view_columns(const MatrixX& m, py::handle owner);
/// Array that shows a whole list.
py::array view(const std::vector<double>& x, py::handle owner);
/// Capsule that holds a shared pointer: owner of arrays whose memory does not belong to a Python
/// object.
template <class T>
py::capsule keep(std::shared_ptr<T> pointer) {
  using Kept = std::shared_ptr<T>;
  return py::capsule(new Kept(std::move(pointer)), [](void* p) { delete static_cast<Kept*>(p); });
}

/// Array with a copy of the data.
py::array copy(const VectorX& x);
py::array copy(const Matrix3& m);
/// Copy of a matrix of Eigen (column-major), transposed if `columns_are_rows`.
py::array copy_matrix(const MatrixX& m, bool columns_are_rows = false);

/// Returns an array for a result: the caller's if given, which must be writable, of doubles and
/// row-major, else a new one of this shape. @throws py::value_error.
py::array_t<double> output(const py::object& given, const Shape1& shape, const char* name);

/// Converts Pose | None | (3,) | (3, 3) | (4, 4) to a pose.
Pose pose_from(py::handle object, const char* name);

}  // namespace counterpoint::python
