// NumPy arrays in and out: views that keep their owner alive, copies, arguments checked by size.
#pragma once

#include <pybind11/numpy.h>

#include <string>
#include <vector>

#include "bindings.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint::python {

/// An argument: anything that NumPy makes an array of doubles of, row by row; not copied if it is
/// one.
using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Shape1 = std::vector<py::ssize_t>;

using ConstMap = Eigen::Map<const VectorX>;
using ConstRowMap =
    Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>;

/// @throws py::value_error "q: expected shape (7,), found (3,)".
void check_shape(const py::array& array, const Shape1& shape, const char* name);
/// "(3, 4)".
std::string shape_text(const py::array& array);

/// The numbers of a vector of `size`, without a copy.
ConstMap vector(const Array& array, Eigen::Index size, const char* name);
/// The same of a matrix.
ConstRowMap matrix(const Array& array, Eigen::Index rows, Eigen::Index columns, const char* name);
Vector3 vector3(const Array& array, const char* name);

/// An array that shows `data`, strides in doubles; `owner` lives as long as it does.
py::array view(const double* data, const Shape1& shape, const Shape1& strides, py::handle owner,
               bool writable = false);
/// The same of all of a vector.
py::array view(const VectorX& x, py::handle owner, bool writable = false);
/// The same of a matrix of Eigen (column by column), rows and columns as they are.
py::array view(const MatrixX& m, py::handle owner, bool writable = false);
/// The same with its columns as rows.
py::array view_columns(const MatrixX& m, py::handle owner);
/// The same of all of a list.
py::array view(const std::vector<double>& x, py::handle owner);
/// A capsule that holds a shared pointer: the owner of arrays whose memory is not a Python
/// object's.
template <class T>
py::capsule keep(std::shared_ptr<T> pointer) {
  using Kept = std::shared_ptr<T>;
  return py::capsule(new Kept(std::move(pointer)), [](void* p) { delete static_cast<Kept*>(p); });
}

/// A copy of its own.
py::array copy(const VectorX& x);
py::array copy(const Matrix3& m);
/// Of a matrix of Eigen (column by column), as its transpose where `columns_are_rows`.
py::array copy_matrix(const MatrixX& m, bool columns_are_rows = false);

/// Makes an array the caller's only on the way back: a new one of this shape, or the one given,
/// which must be writable, of doubles, row by row. @throws py::value_error.
py::array_t<double> output(const py::object& given, const Shape1& shape, const char* name);

/// Pose | None | (3,) | (3, 3) | (4, 4).
Pose pose_from(py::handle object, const char* name);

}  // namespace counterpoint::python
